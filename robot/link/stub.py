"""A simulated robot in a process of its own, which starts and ends with a run."""

import dataclasses
import json
import socket
import warnings
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager

from spikeport.child import START_S, Child
from spikeport.errors import BackendError, RobotLostError
from spikeport.pacing import Pace
from spikeport.robot.link.client import Observed, RobotClient
from spikeport.robot.link.faults import FAULTS, never_reached
from spikeport.robot.link.messages import TRUTHS, Topic
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.over_dds import join
from spikeport.robot.link.place import Place
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import MotorCommands

DOMAINS = range(2, 102)
"""Domains of stubs, whose ports are below the ephemeral ports of operating systems."""


class StubRobot(RobotClient):
    """A simulated robot in a process of its own, which ends with this client.

    Parameters
    ----------
    settings : RobotSettings
        The robot.
    pace : Pace or None
        The pace of commands in real time; None in lock-step.
    faults : sequence of str
        A plan of faults.
    needs : Topic or None
        A topic beside the states that a complete observation needs.
    """

    def __init__(
        self,
        settings: RobotSettings,
        pace: Pace | None = None,
        faults: Sequence[str] = (),
        needs: Topic | None = TRUTHS,
    ) -> None:
        super().__init__()
        self._claim, place = _free_domain()
        self._output = ""
        self._plan = [FAULTS.parse(text) for text in faults]
        self._commands = 0
        try:
            self._child = Child("robot", _arguments(place, settings, pace, faults))
            try:
                # In lock-step nothing else commands a stub, so no switcher is asked.
                self._client = join(place, pace, needs, switches=pace is not None)
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
        with self._end_explained():
            return self._client.first(lambda: self._child.runs)

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        """Answer an observation, and return the next; see `RobotClient.exchange`."""
        self._commands += 1
        with self._end_explained():
            return self._client.exchange(last, motors)

    @contextmanager
    def _end_explained(self) -> Iterator[None]:
        """Add the last output of a robot that died to an error: it says more than silence."""
        try:
            yield
        except BackendError as error:
            if self._child.runs:
                raise
            self._output = self._child.close()
            raise RobotLostError(f"{error}; its process ended: {self._output}") from None

    def close(self) -> None:
        """Leave the robot, wait for the end of its process, and warn of faults never reached."""
        with ExitStack() as left:  # the process ends even if the client cannot leave
            # Called last, as a user may have turned warnings into errors.
            left.callback(self._warn_of_faults)
            left.callback(self._claim.close)
            left.callback(self._end)
            self._client.close()

    def _warn_of_faults(self) -> None:
        for line in never_reached(self._plan, self._commands):
            warnings.warn(line, stacklevel=2)

    def _end(self) -> None:
        """Wait for the end of the robot's process, and keep its last output."""
        self._output = self._output or self._child.close()

    def summary(self) -> dict[str, object]:
        """Return the figures, with the robot's own summary once it has ended."""
        return {**self._client.summary(), "robot": _summary_of(self._output)}


def _summary_of(output: str) -> object:
    """Return the summary that a robot prints as it ends; without one, its output."""
    try:
        return json.loads(output.splitlines()[-1].removeprefix("robot: "))
    except (IndexError, ValueError):
        return output


def _arguments(
    place: Place, settings: RobotSettings, pace: Pace | None, faults: Sequence[str]
) -> list[str]:
    # `repr` writes a float in full: the run must be the same to the last bit.
    clock = (
        ["--lock-step", "--rate-hz", repr(settings.rate_hz)] if pace is None else _priority(pace)
    )
    return [
        *("robot", "serve", "--interface", place.interface, "--domain", str(place.domain)),
        *("--truth", "--once", "--idle", str(START_S), "--seed", str(settings.seed)),
        *("--watchdog-ms", repr(1000 * settings.watchdog_s)),
        *clock,
        *(["--hoist"] if settings.hoist else []),
        *_odometer(settings.odometer),
        *(p for fault in faults for p in ("--fault", fault)),
        *(p for joint, rad in settings.posture_rad.items() for p in ("--pose", f"{joint}={rad!r}")),
    ]


def _priority(pace: Pace) -> list[str]:
    return [] if pace.priority is None else ["--priority", str(pace.priority)]


def _odometer(errors: OdometerErrors | None) -> list[str]:
    if errors is None:
        return []
    values = dataclasses.asdict(errors).items()
    return ["--odometer", *(p for k, v in values for p in ("--odometer-error", f"{k}={v!r}"))]


def _free_domain() -> tuple[socket.socket, Place]:
    """Return the claim of a domain that no other stub of this machine uses, and the domain.

    The claim is an abstract Unix socket: no file, and gone with its process.
    """
    for domain in DOMAINS:
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            claim.bind(f"\0spikeport-robot-{domain}")
        except OSError:
            claim.close()
            continue
        return claim, Place(domain=domain)
    raise BackendError(f"{len(DOMAINS)} stubs of robots run already; end some of them")
