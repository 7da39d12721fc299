"""Robots at the other end of a bus, in lock-step or in real time."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from spikeport.errors import RobotLostError
from spikeport.pacing import Deadlines, Pace, RoundTrips, undisturbed
from spikeport.robot.link.admission import LATEST_S, beyond, h1_limits, too_old
from spikeport.robot.link.client import CommandedRobot, Observed, began_anew, observed
from spikeport.robot.link.codec import STATE, TICK_S, Command, encode_command, remote_of, turn_of
from spikeport.robot.link.companion import Companions
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import Published
from spikeport.robot.link.messages import COMMANDS, ODOMETRY, STATES, TRUTHS, Topic
from spikeport.robot.link.motion_switcher import MotionSwitcher
from spikeport.robot.link.place import Place
from spikeport.robot.link.wire import MessageError
from spikeport.robot.signals import MotorCommands

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Arrival, Bus

FIRST_S = 20.0
"""Time in which a robot's first state must come."""
PATIENCE_S = 10.0
"""Time in which a robot in lock-step must answer."""
RESTART_S = 1.0
"""In real time, a robot has begun anew if its tick goes back by more than this."""
SLICE_S = 0.2
DAMPINGS = 3
"""The number of damping commands that a controller sends as it leaves."""
_ANOTHER_DRIVES = "another controller drives the robot; only one can at a time"
"""The reason why a controller that comes second has no robot."""


class DdsRobot(CommandedRobot):
    """A robot at the other end of a bus.

    Parameters
    ----------
    bus : Bus
        The bus of the robot; closed with this robot.
    needs : Topic or None
        A topic beside the states that a complete observation needs: `TRUTHS`, which only a
        simulation has, or `ODOMETRY`.
    waits : bool
        True to wait for the messages beside a state, as in lock-step.
    switcher : MotionSwitcher, optional
        Releases sport mode before the first command.
    """

    def __init__(
        self,
        bus: "Bus",
        needs: Topic | None,
        waits: bool,
        switcher: MotionSwitcher | None = None,
    ) -> None:
        super().__init__()
        self._bus = bus
        self._states, self._commands = bus.reader(STATES), bus.writer(COMMANDS)
        self._beside = Companions(bus, needs, waits)
        self._switcher, self._commanded = switcher, False
        self._runs, self._writer, self._refusals = False, 0, 0
        self._lacks = f"nobody publishes {STATES.name}; is `spikeport robot serve` running there?"
        self._released: list[str] | None = None

    def first(self, runs: Callable[[], bool] = lambda: True) -> Observed:
        """Release sport mode, and return the first observation.

        Parameters
        ----------
        runs : callable
            Returns False once the robot is known to have ended: nobody waits for it any longer.

        Raises
        ------
        RobotLostError
            If no observation comes in time.
        BackendError
            If sport mode is not released.
        """
        found = self._await(runs)
        if self._switcher is not None:
            self._released = self._switcher.release()
            if self._released:
                # Messages so far came from sport mode, which may fall silent.
                self._beside.forget()
            found = self._await(runs)
        self._runs = True
        return found

    def _await(self, runs: Callable[[], bool]) -> Observed:
        """Wait for a robot, and return its newest observation."""
        until = time.monotonic() + FIRST_S
        while time.monotonic() < until:
            found = self._newest(SLICE_S)
            # A state alone is not enough: commands to a robot that does not read them yet would be
            # lost.
            if found is not None and self._commands.n_readers:
                return found
            if found is not None:
                self._lacks = "it publishes states but does not read commands"
            if not runs():
                raise RobotLostError("the robot sent no first state")
        raise RobotLostError(f"no robot was ready within {FIRST_S:g} s: {self._lacks}")

    def _newest(self, within_s: float) -> Observed | None:
        """Return the newest observation of those that come within a time."""
        read = [self._read(arrival) for arrival in self._states.take(within_s)]
        found = [one for one in read if one is not None]
        if not found:
            return None
        newest = found.pop()
        self._take_beside(newest)
        if missing := self._beside.missing(begins=not self._runs):
            self._lacks = missing
            return None
        truth, odometry = self._beside.newest(TRUTHS), self._beside.newest(ODOMETRY)
        between = tuple(one.sensors for one in found)
        return newest._replace(truth=truth, odometry=odometry, between=between)

    def _take_beside(self, state: Observed) -> None:
        """Take the messages beside a state; damp a robot whose topic that it needs is refused."""
        refused = self._beside.take(state.tick)
        self.figures.damaged = self._refusals + self._beside.refused
        if refused is not None and self._runs:
            self._distrust(state.asks, refused)

    def _watch_beside(self, tick: int, now_s: float) -> None:
        """Damp the robot if the topic that gives its motion fell silent."""
        silence = self._beside.silence(now_s)
        if silence is not None:
            self._distrust(tick, silence)

    def _read(self, arrival: "Arrival") -> Observed | None:
        """Return the observation of a state; None if it is refused. The first writer is trusted."""
        message, writer = arrival
        if self._writer not in (0, writer):
            self._refuse(
                f"a state came from writer {writer}, earlier states from writer {self._writer}; "
                "cure: end one of the two robots, or give each its own --domain",
                message,
            )
            return None
        try:
            found = observed(Published(message, None), writer, remote_of(message))
        except MessageError as error:
            self._refuse(str(error), message)
            return None
        self._writer = writer
        return found

    def _refuse(self, reason: str, message: bytes) -> None:
        """Count a refused message; during a run, damp the robot and end the run."""
        self._refusals += 1
        self.figures.damaged += 1
        self._lacks = f"its last state was refused ({reason})"
        if self._runs:
            self._distrust(self._asked_by(message), reason)

    def _asked_by(self, message: bytes) -> int:
        """Return the tick that a state asks an answer for, even if it is refused."""
        # A message of another size has no fields in known places.
        return turn_of(message).asks if len(message) == STATE.size else 0

    def _distrust(self, tick: int, reason: str) -> None:
        """Damp the robot, as an answer to a tick, and end the run."""
        raise self._damped(tick, reason)

    def _send(self, tick: int, motors: MotorCommands) -> None:
        self._commanded = True
        self._commands.write(encode_command(Command(tick, motors)))

    def close(self) -> None:
        """Leave the robot, and DDS."""
        self._bus.close()

    def summary(self) -> dict[str, object]:
        """Return the figures, with the modes that were released; None without a switcher."""
        return {**super().summary(), "released_modes": self._released}


class LockStepRobot(DdsRobot):
    """A robot that waits for the answer to each of its states.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    needs : Topic or None
        A topic beside the states that a complete observation needs.
    switcher : MotionSwitcher, optional
        Releases sport mode before the first command.
    """

    def __init__(
        self,
        bus: "Bus",
        needs: Topic | None,
        switcher: MotionSwitcher | None = None,
    ) -> None:
        super().__init__(bus, needs, True, switcher)
        self._trips = RoundTrips()

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and wait for the next; see `RobotClient.exchange`."""
        begin = time.perf_counter()
        self._send(last.asks, motors)
        while (left := PATIENCE_S - (time.perf_counter() - begin)) > 0:
            found = self._newest(min(left, SLICE_S))
            if found is None:
                if not self._states.writers:
                    break
                continue
            if found.asks != last.asks:
                self._trips.add(time.perf_counter() - begin)
                self._watch_beside(found.asks, TICK_S * found.asks)
                return self._follow(last, found)
            self._send(last.asks, motors)  # it asks again: the answer was lost
        raise RobotLostError(f"the robot sent no state after that of {last.asks:,} ms")

    def _read(self, arrival: "Arrival") -> Observed | None:
        """Return the observation of a state that is for this controller; None if it is not.

        A robot that obeys another controller finishes that run first, and then begins anew: its
        states until then belong to the other run.
        """
        found = super()._read(arrival)
        if found is not None and not self._runs and turn_of(arrival.message).asks == 0:
            # It would step by its clock, however long an answer takes.
            raise RobotLostError(
                "this robot runs in real time and does not wait for answers; cure: serve it with "
                "--lock-step, or leave out --robot-lock-step"
            )
        if found is None or found.controller in (0, self._commands.number * self._runs):
            return found
        if self._runs:
            raise RobotLostError(_ANOTHER_DRIVES)
        self._lacks = _ANOTHER_DRIVES
        return None

    def summary(self) -> dict[str, object]:
        """Return the figures, with round trips in us."""
        return {**super().summary(), "round_trip_us": self._trips.summary_us()}


class RealTimeRobot(DdsRobot):
    """A robot in real time: its latest state wins.

    Parameters
    ----------
    bus : Bus
        The bus of the robot.
    needs : Topic or None
        A topic beside the states that a complete observation needs.
    pace : Pace
        The pace of commands.
    switcher : MotionSwitcher, optional
        Releases sport mode before the first command.
    """

    def __init__(
        self,
        bus: "Bus",
        needs: Topic | None,
        pace: Pace,
        switcher: MotionSwitcher | None = None,
    ) -> None:
        super().__init__(bus, needs, False, switcher)
        self._deadlines = Deadlines(pace.period_s, pace.clock)
        self._clock, self._priority, self._shared = pace.clock, pace.priority, pace.shared
        self._limits = h1_limits()
        self._seen_s = 0.0
        self._undisturbed = ExitStack()

    def first(self, runs: Callable[[], bool] = lambda: True) -> Observed:
        """Return the first observation; see `DdsRobot.first`."""
        self._undisturbed.enter_context(undisturbed(self._priority))
        found = super().first(runs)
        self._deadlines.begin()
        self._seen_s = self._clock.now()
        self._beside.watch_from(self._seen_s)
        return found

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        """Send a command, wait for the next step, and return the newest observation then."""
        self._send(last.tick, motors)
        self._deadlines.begin(waited=self._shared)
        self.figures.overruns = self._deadlines.overruns
        found, now = self._newest(0.0), self._clock.now()
        self._watch_beside(last.tick, now)
        if found is not None and TICK_S * (last.tick - found.tick) > RESTART_S:
            # It may be in sport mode again, which is released only as a run begins.
            raise self._damped(found.tick, began_anew(last.tick, found.tick))
        # A state that came again is as old as before: its age counts from when it first came.
        if found is None or found.tick <= last.tick:
            self.figures.held += 1
            self._watch_silence(last.tick, now)
            return last
        self.figures.states += 1
        self._seen_s = now
        return found

    def _read(self, arrival: "Arrival") -> Observed | None:
        """Return the observation of a state; None if it is refused, as an implausible one is."""
        found = super()._read(arrival)
        # A robot by the clock asks for nothing, 0, which is also its tick as it is switched on.
        if found is not None and not self._runs and 0 < turn_of(arrival.message).asks == found.tick:
            # It would step by each answer, and not by the clock.
            raise RobotLostError("this robot waits in lock-step; cure: give --robot-lock-step")
        reason = None if found is None else beyond(found.sensors, self._limits)
        if reason is None:
            # Real firmware may leave anything in the field of `asks`.
            return None if found is None else found._replace(asks=found.tick, came=found.tick)
        self._refuse(reason, arrival.message)
        return None

    def _asked_by(self, _message: bytes) -> int:
        return 0

    def _watch_silence(self, tick: int, now_s: float) -> None:
        """Damp the robot if no new state came for too long."""
        age_s = now_s - self._seen_s
        if age_s > LATEST_S:
            self._distrust(tick, too_old(age_s))

    def close(self) -> None:
        """Command damping, if the robot was ever commanded, and leave."""
        with ExitStack() as left:  # all are done, even if the bus cannot be written to
            left.callback(self._undisturbed.close)
            left.callback(super().close)
            # Several, since in real time a message may be lost, and nobody is left to repeat it.
            for _ in range(DAMPINGS if self._commanded else 0):
                self._send(0, DAMPING)


def join(
    place: Place,
    pace: Pace | None,
    needs: Topic | None = TRUTHS,
    switches: bool = True,
) -> DdsRobot:
    """Return the robot at a place.

    Parameters
    ----------
    place : Place
        The domain and interface of the robot.
    pace : Pace or None
        The pace of commands; None in lock-step.
    needs : Topic or None
        A topic beside the states that a complete observation needs.
    switches : bool
        True if sport mode is released first; a stub in lock-step has no sport mode.

    Raises
    ------
    MissingExtraError
        If cyclonedds is absent.
    BackendError
        If DDS cannot begin there.
    """

    def make(bus: "Bus") -> DdsRobot:
        switcher = MotionSwitcher(bus, place.may_be_real) if switches else None
        if pace is None:
            return LockStepRobot(bus, needs, switcher)
        return RealTimeRobot(bus, needs, pace, switcher)

    return on_bus(place, pace is None, make)


def on_bus(place: Place, reliable: bool, make: Callable[["Bus"], DdsRobot]) -> DdsRobot:
    """Return the robot that ``make`` makes on a new bus; raises as `join`."""
    from spikeport.robot.link.bus import Bus  # needs cyclonedds

    bus = Bus(place, reliable=reliable)
    try:
        return make(bus)
    except BaseException:
        bus.close()
        raise
