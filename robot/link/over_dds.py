"""Robots at the other end of a bus: one that waits for answers, and one that keeps to the clock."""

import time
from typing import TYPE_CHECKING

from spikeport.errors import RobotLostError
from spikeport.pacing import Clock, Deadlines, RoundTrips, SystemClock
from spikeport.robot.link.client import Observed, RobotClient, check_order
from spikeport.robot.link.codec import Command, Truth, decode_state, decode_truth, encode_command
from spikeport.robot.link.messages import COMMANDS, STATES, TRUTHS
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import DAMPING
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.signals import MotorCommands
from spikeport.robot.link.wire import MessageError

if TYPE_CHECKING:
    from spikeport.robot.link.bus import Bus

FIRST_S = 20.0
"""Time in which a robot's first state must come."""
PATIENCE_S = 10.0
"""Time in which a robot in lock-step must answer."""
STALE_S = 0.1
"""Age of a state, in real time, with which no robot is controlled any more."""
SLICE_S = 0.2
DAMPINGS = 3
"""How often a robot is told to go into damping when its controller leaves."""


class DdsRobot(RobotClient):
    """A robot at the other end of a bus.

    Parameters
    ----------
    bus : Bus
        Where it is; closed with this.
    wants_truth : bool
        Whether an observation is whole only with the truth of its tick.
    """

    def __init__(self, bus: "Bus", wants_truth: bool) -> None:
        super().__init__()
        self._bus = bus
        self._states, self._commands = bus.reader(STATES), bus.writer(COMMANDS)
        self._truths = bus.reader(TRUTHS) if wants_truth else None
        self._truth: Truth | None = None

    def first(self) -> Observed:
        """Return the first observation; raises RobotLostError if none comes in time."""
        until = time.monotonic() + FIRST_S
        while time.monotonic() < until:
            found = self._newest(SLICE_S)
            if found is not None and self._commands.n_readers:
                return found
        raise RobotLostError(
            f"no robot within {FIRST_S:g} s; is `spikeport robot serve` running there, with "
            "--truth where the truth is asked for?"
        )

    def _newest(self, within_s: float) -> Observed | None:
        """Return the newest observation of those that come within a time."""
        newest = None
        for arrival in self._states.take(within_s):
            try:
                tick, sensors = decode_state(arrival.message)
            except MessageError:
                self.figures.damaged += 1
                continue
            newest = Observed(tick, sensors, None)
        if newest is None or self._truths is None:
            return newest
        self._take_truth(newest.tick)
        return None if self._truth is None else newest._replace(truth=self._truth)

    def _take_truth(self, tick: int) -> None:
        """Take truths until that of a tick, which was sent before its state, is there."""
        assert self._truths is not None
        within_s = 0.0
        while self._truth is None or self._truth.tick < tick:
            arrivals = self._truths.take(within_s)
            if not arrivals and within_s:
                return
            for arrival in arrivals:
                try:
                    self._truth = decode_truth(arrival.message)
                except MessageError:
                    self.figures.damaged += 1
            within_s = 0.01

    def _send(self, tick: int, motors: MotorCommands) -> None:
        self._commands.write(encode_command(Command(tick, motors)))

    def close(self) -> None:
        """Leave the robot, and DDS."""
        self._bus.close()


class LockStepRobot(DdsRobot):
    """A robot that waits for the answer to each of its states.

    Parameters
    ----------
    bus : Bus
        Where it is.
    """

    def __init__(self, bus: "Bus") -> None:
        super().__init__(bus, wants_truth=True)
        self._trips = RoundTrips()

    def exchange(self, seen: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and wait for the next; see `RobotClient.exchange`."""
        begin = time.perf_counter()
        self._send(seen.tick, motors)
        while (left := PATIENCE_S - (time.perf_counter() - begin)) > 0:
            found = self._newest(min(left, SLICE_S))
            if found is None:
                if not self._states.writers:
                    break
                continue
            check_order(seen, found)
            if found.tick > seen.tick:
                self.figures.states += 1
                self._trips.add(time.perf_counter() - begin)
                return found
            self._send(seen.tick, motors)  # it asks again: the answer was lost
        raise RobotLostError(f"the robot does not answer its state of {seen.tick:,} ms")

    def summary(self) -> dict[str, object]:
        """Return the figures, with round trips in us."""
        return {**super().summary(), "round_trip_us": self._trips.summary_us()}


class RealTimeRobot(DdsRobot):
    """A robot that keeps to the clock: its latest state wins.

    Parameters
    ----------
    bus : Bus
        Where it is.
    wants_truth : bool
        Whether the truth is asked for, which only a simulation has.
    period_s : float
        Time from one command to the next.
    clock : Clock
        The clock.
    """

    def __init__(self, bus: "Bus", wants_truth: bool, period_s: float, clock: Clock) -> None:
        super().__init__(bus, wants_truth)
        self._deadlines, self._clock = Deadlines(period_s, clock), clock
        self._seen_s = 0.0

    def first(self) -> Observed:
        """Return the first observation; see `RobotClient.first`."""
        found = super().first()
        self._deadlines.begin()
        self._seen_s = self._clock.now()
        return found

    def exchange(self, seen: Observed, motors: MotorCommands) -> Observed:
        """Command, wait for the next step, and return what is newest then."""
        self._send(seen.tick, motors)
        self._deadlines.begin()
        self.figures.overruns = self._deadlines.overruns
        found, now = self._newest(0.0), self._clock.now()
        if found is None or found.tick == seen.tick:
            self.figures.held += 1
            if now - self._seen_s > STALE_S:
                raise RobotLostError(
                    f"no new state for {1000 * (now - self._seen_s):.0f} ms, allowed "
                    f"{1000 * STALE_S:.0f} ms; the robot was told to go into damping"
                )
            return seen
        check_order(seen, found)
        self.figures.states += 1
        self._seen_s = now
        return found

    def close(self) -> None:
        """Tell the robot to go into damping, and leave."""
        for _ in range(DAMPINGS):
            self._send(0, DAMPING)
        super().close()


def join(place: Place, real_time: bool, settings: RobotSettings) -> DdsRobot:
    """Return the robot at a place; raises MissingExtraError or BackendError if DDS cannot begin."""
    from spikeport.robot.link.bus import Bus  # needs cyclonedds

    bus = Bus(place, keeps_all=not real_time)
    try:
        if not real_time:
            return LockStepRobot(bus)
        return RealTimeRobot(bus, True, 1 / settings.rate_hz, SystemClock())
    except BaseException:
        bus.close()
        raise
