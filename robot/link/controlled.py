"""A robot in real time that its user starts and stops, by the states of the controller."""

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from spikeport.errors import RobotLostError
from spikeport.pacing import Pace
from spikeport.robot.link.admission import too_old
from spikeport.robot.link.client import Observed
from spikeport.robot.link.controller import HOLD, Controller
from spikeport.robot.link.controller_states import State
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.messages import Topic
from spikeport.robot.link.motion_switcher import MotionSwitcher
from spikeport.robot.link.over_dds import FIRST_S, DdsRobot, RealTimeRobot, on_bus
from spikeport.robot.link.place import Place
from spikeport.robot.link.terminal import Terminal, own_terminal
from spikeport.robot.signals import MotorCommands

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Bus

KEYS = {
    State.ZERO_TORQUE: "start or s: to the default pose; select or space: damping",
    State.HOLD: "let it down from its hoist; A or a: run",
    State.RUN: "select or space: damping, and the run ends",
    State.DAMPING: "L1 and R1 or r: begin anew",
}
"""The keys of the remote and the terminal that leave each state, as users read them."""
REMOTE_ALONE = (
    "robot: only the remote's keys are read, not a terminal's; cure: without a remote, run the "
    "command in the foreground of a terminal"
)
"""The line for users whose command has no terminal, or is not in its foreground."""


class ControlledRobot(RealTimeRobot):
    """A robot whose run begins when its user starts it, and ends in damping.

    The first observation is the one with which the controller enters ``RUN``; leaving that state
    ends the run.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    needs : Topic or None
        A topic beside the states that a complete observation needs.
    pace : Pace
        The pace of commands.
    terminal : Terminal
        The user's keys; closed with this robot.
    say : callable
        Prints a line, for each state.
    switcher : MotionSwitcher, optional
        Releases sport mode before zero torque.
    """

    def __init__(
        self,
        bus: "Bus",
        needs: Topic | None,
        pace: Pace,
        terminal: Terminal,
        say: Callable[[str], None],
        switcher: MotionSwitcher | None = None,
    ) -> None:
        super().__init__(bus, needs, pace, switcher)
        self._terminal, self._say = terminal, say
        self._motors, self._answered_tick = HOLD, -1
        self._controller = Controller(lambda _: self._motors)

    def first(self, runs: Callable[[], bool] = lambda: True) -> Observed:
        """Lead the robot to ``RUN`` by its user's keys, and return the observation there.

        Raises
        ------
        RobotLostError
            If no robot is found, or it is gone.
        """
        last, printed = super().first(runs), State.WAIT
        if not self._terminal.is_heard:
            self._say(REMOTE_ALONE)
        while True:
            command, state = self._answer(last), self._controller.state
            if state is not printed:
                printed = state
                self._say(self._line(state))
            if state is State.RUN:
                self._send(last.tick, command)
                return last
            last = super().exchange(last, command)

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        """Send the controller's command, and return the newest observation after it.

        Raises
        ------
        RobotLostError
            If the controller left ``RUN``, so that the robot is damped, or no state comes.
        """
        self._motors = motors
        command = self._answer(last)
        if self._controller.state is not State.RUN:
            self._send(last.tick, DAMPING)
            reason = self._controller.damped_for or "stop was pressed"
            raise RobotLostError(f"the robot was commanded to go into damping: {reason}")
        return super().exchange(last, command)

    def _line(self, state: State) -> str:
        """Return a line on a state, and on the keys that leave it."""
        reason = self._controller.damped_for if state is State.DAMPING else ""
        name = f"{state.value}: {reason}" if reason else state.value
        return f"robot: {name}. {KEYS.get(state, '')}".rstrip()

    def _answer(self, last: Observed) -> MotorCommands:
        """Return the controller's command; a held observation keeps its age."""
        for event in self._terminal.events():
            self._controller.happen(event)
        held, self._answered_tick = last.tick == self._answered_tick, last.tick
        # A new state is judged at the time it came, a held one at the present time.
        now_s = self._clock.now() if held else self._seen_s
        return self._controller.answer(last.sensors, last.remote, now_s)

    def _distrust(self, tick: int, reason: str) -> None:
        """Let the controller damp a moving robot, which ends a run that had begun."""
        self._controller.refuse(reason)

    def _watch_silence(self, tick: int, now_s: float) -> None:
        """Damp a moving robot that fell silent; give up on one that stays silent, in any state."""
        if self._controller.watch(now_s):
            self._send(tick, DAMPING)
        age_s = now_s - self._seen_s
        if age_s > FIRST_S:
            raise self._damped(tick, too_old(age_s, FIRST_S))

    def close(self) -> None:
        """Command damping, and leave the robot and the terminal."""
        try:
            super().close()
        finally:
            self._terminal.close()

    def summary(self) -> dict[str, object]:
        """Return the figures of the link and of the controller."""
        controller = self._controller
        return {
            **super().summary(),
            "state": controller.state.value,
            "refusals": controller.refusals,
            "refused": controller.refused,
        }


def join_by_hand(place: Place, pace: Pace, needs: Topic | None) -> DdsRobot:
    """Return the robot at a place, in real time, controlled by keys; see `over_dds.join`."""
    terminal = own_terminal()

    def make(bus: "Bus") -> DdsRobot:
        switcher = MotionSwitcher(bus, place.may_be_real)
        return ControlledRobot(bus, needs, pace, terminal, _say, switcher)

    try:
        return on_bus(place, False, make)
    except BaseException:
        terminal.close()
        raise


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
