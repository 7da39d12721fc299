"""Connections to robots: in this process, in one of its own, or wherever DDS reaches."""

import json
import re
import socket
from dataclasses import dataclass

from spikeport.child import START_S, Child
from spikeport.errors import BackendError, RobotLostError, UsageError
from spikeport.pacing import SystemClock
from spikeport.robot.link.client import (
    DdsRobot,
    InlineRobot,
    LockStepRobot,
    Observed,
    RealTimeRobot,
    RobotClient,
)
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.place import Place
from spikeport.robot.link.robot import RobotSettings, SimulatedRobot
from spikeport.robot.link.signals import MotorCommands

INLINE, STUB = "inline", "stub"
FORMS = "inline, stub or dds:INTERFACE:DOMAIN"
STUB_DOMAINS = range(2, 102)
"""Domains of stubs: of each, the ports are below those that systems give away."""


@dataclass(frozen=True)
class RobotOptions:
    """A robot for a run, as it was asked for.

    Attributes
    ----------
    robot : str
        ``inline``, ``stub`` or ``dds:INTERFACE:DOMAIN``.
    real_time : bool
        Whether it keeps to the clock.
    faults : tuple of str
        A plan of faults, see `spikeport.robot.link.faults`.
    may_move_a_robot : bool
        Whether a place is allowed where a real robot may listen.
    """

    robot: str
    real_time: bool = False
    faults: tuple[str, ...] = ()
    may_move_a_robot: bool = False

    def check(self) -> None:
        """Refuse what does not go together; raises UsageError."""
        for text in self.faults:
            FAULTS.parse(text)
        if self.robot in (INLINE, STUB):
            if self.faults and self.real_time:
                raise UsageError("--robot-fault is for lock-step: real time has faults of its own")
            if self.real_time and self.robot == INLINE:
                raise UsageError("an inline robot has no clock; real time takes --robot stub")
            return
        self.place.check(self.may_move_a_robot)
        if self.faults:
            raise UsageError("--robot-fault is for inline and stub; else give --fault to the robot")

    @property
    def place(self) -> Place:
        """Where the robot is; UsageError if the text names no place."""
        found = re.fullmatch(r"dds:(?P<interface>[^:]+):(?P<domain>[0-9]{1,3})", self.robot)
        if found is None:
            raise UsageError(f"--robot {self.robot!r}: write {FORMS}")
        return Place(found["interface"], int(found["domain"]))


def connect(options: RobotOptions, settings: RobotSettings) -> RobotClient:
    """Return a robot to control.

    Parameters
    ----------
    options : RobotOptions
        Which one.
    settings : RobotSettings
        Of a robot that is made for this; another one is as it is.

    Raises
    ------
    UsageError
        If the options do not go together.
    MissingExtraError
        If cyclonedds is absent.
    BackendError
        If a stub does not start, or DDS cannot begin.
    """
    options.check()
    if options.robot == INLINE:
        faults = [FAULTS.parse(text) for text in options.faults]
        return InlineRobot(LockStep(SimulatedRobot(settings), faults))
    if options.robot == STUB:
        return StubRobot(options, settings)
    return _over_dds(options.place, options.real_time, settings)


def _over_dds(place: Place, real_time: bool, settings: RobotSettings) -> DdsRobot:
    from spikeport.robot.link.bus import Bus  # needs cyclonedds

    bus = Bus(place, keeps_all=not real_time)
    try:
        if not real_time:
            return LockStepRobot(bus)
        return RealTimeRobot(bus, True, 1 / settings.rate_hz, SystemClock())
    except BaseException:
        bus.close()
        raise


class StubRobot(RobotClient):
    """A simulated robot in a process of its own, which ends with this.

    Parameters
    ----------
    options : RobotOptions
        Its clock and faults.
    settings : RobotSettings
        The robot.
    """

    def __init__(self, options: RobotOptions, settings: RobotSettings) -> None:
        super().__init__()
        self._claim, place = _free_domain()
        self._words = ""
        try:
            self._child = Child("robot", _arguments(place, options, settings))
            try:
                self._client = _over_dds(place, options.real_time, settings)
            except BaseException:
                self._child.close()
                raise
        except BaseException:
            self._claim.close()
            raise

    @property
    def process_id(self) -> int:
        """The number of the robot's process."""
        return self._child.process_id

    def first(self) -> Observed:
        """Return the first observation; see `RobotClient.first`."""
        return self._client.first()

    def exchange(self, seen: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and return the next; see `RobotClient.exchange`."""
        try:
            return self._client.exchange(seen, motors)
        except RobotLostError as error:
            if self._child.runs:
                raise
            self._words = self._child.close().strip()
            raise RobotLostError(f"{error}; its process ended: {self._words}") from None

    def close(self) -> None:
        """Leave the robot, and wait for the end of its process."""
        self._client.close()
        self._words = self._words or self._child.close().strip()
        self._claim.close()

    def summary(self) -> dict[str, object]:
        """Return the figures, with what the robot says of itself once it has ended."""
        return {**self._client.summary(), "robot": _last_words(self._words)}


def _last_words(words: str) -> object:
    """Return what a robot says of itself as it ends; its words, where it ended otherwise."""
    try:
        return json.loads(words.splitlines()[-1].removeprefix("robot: "))
    except (IndexError, ValueError):
        return words


def _arguments(place: Place, options: RobotOptions, settings: RobotSettings) -> list[str]:
    clock = [] if options.real_time else ["--lock-step", "--rate-hz", repr(settings.rate_hz)]
    return [
        *("robot", "serve", "--interface", place.interface, "--domain", str(place.domain)),
        *("--truth", "--once", "--idle", str(START_S), "--seed", str(settings.seed)),
        *("--watchdog-ms", repr(1000 * settings.watchdog_s)),
        *clock,
        *(["--hoist"] if settings.hoist else []),
        *(p for fault in options.faults for p in ("--fault", fault)),
        *(p for joint, rad in settings.posture_rad.items() for p in ("--pose", f"{joint}={rad!r}")),
    ]


def _free_domain() -> tuple[socket.socket, Place]:
    """Return a domain of which no other stub of this machine is, and what claims it.

    The claim is an abstract Unix socket: no file, and gone with its process.
    """
    for domain in STUB_DOMAINS:
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            claim.bind(f"\0spikeport-robot-{domain}")
        except OSError:
            claim.close()
            continue
        return claim, Place(domain=domain)
    raise BackendError(f"{len(STUB_DOMAINS)} stubs of robots run already; end some of them")
