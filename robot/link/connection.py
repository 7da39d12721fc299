"""Connections to robots: in this process, in a process of their own, or over DDS."""

import dataclasses
import re
from dataclasses import dataclass

from spikeport.errors import UsageError
from spikeport.pacing import Pace
from spikeport.robot.estimator.registry import EKF, TRUTH, check_estimator
from spikeport.robot.link.client import InlineRobot, RobotClient
from spikeport.robot.link.controlled import join_by_hand
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.messages import ODOMETRY, TRUTHS
from spikeport.robot.link.motion import needed
from spikeport.robot.link.odometer import OdometerErrors
from spikeport.robot.link.over_dds import join
from spikeport.robot.link.place import REAL, Place
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.link.stub import StubRobot

INLINE, STUB = "inline", "stub"
FORMS = "inline, stub or dds:INTERFACE:DOMAIN"


@dataclass(frozen=True)
class RobotOptions:
    """The options of a run's robot.

    Attributes
    ----------
    robot : str
        ``inline``, ``stub`` or ``dds:INTERFACE:DOMAIN``.
    real_time : bool
        True if the robot runs in real time.
    faults : tuple of str
        A plan of faults, see `spikeport.robot.link.faults`.
    may_move_a_robot : bool
        True to allow a place where a real robot may listen.
    estimator : str or None
        The estimator of the robot's motion, see `spikeport.robot.estimator.registry`; by default
        the truth for a robot that is made for the run, and the filter for a robot that is there
        already.
    states : bool
        True if the user starts and stops the robot, as always where a real robot may listen.
    priority : int or None
        The real-time priority of both sides, while they run in real time.
    """

    robot: str
    real_time: bool = False
    faults: tuple[str, ...] = ()
    may_move_a_robot: bool = False
    estimator: str | None = None
    states: bool = False
    priority: int | None = None

    def check(self) -> None:
        """Raise UsageError if the options do not go together."""
        for text in self.faults:
            FAULTS.parse(text)
        check_estimator(self.estimates)
        if self.states and (self.is_made_for_the_run or not self.real_time):
            raise UsageError(
                "--robot-states is for --robot dds:... in real time; elsewhere a run starts at once"
            )
        if self.priority is not None and not self.real_time:
            raise UsageError("--robot-priority is for real time; lock-step has no deadlines")
        if self.is_made_for_the_run:
            self._check_made()
        else:
            self._check_place()

    def _check_made(self) -> None:
        """Check a robot that is made for the run."""
        if self.faults and self.real_time:
            raise UsageError("--robot-fault is for lock-step: real time has faults of its own")
        if self.real_time and self.robot == INLINE:
            raise UsageError("an inline robot has no clock; for real time, give --robot stub")

    def _check_place(self) -> None:
        """Check a robot that is there already, and may be a real one."""
        self.place.check(self.may_move_a_robot)
        if not self.real_time and self.place.domain == REAL:
            raise UsageError(
                f"--robot-lock-step in domain {REAL}: a real robot does not wait for answers, "
                "and would move at once; serve a simulation in domain 1, or leave out "
                "--robot-lock-step"
            )
        if self.estimates == TRUTH and self.may_be_real:
            # A robot in sport mode publishes on that topic, and falls silent there when released.
            raise UsageError(
                "--estimator truth: only a simulation knows the truth, and a real robot may listen "
                "there; give --estimator ekf, or odometer where the robot has one"
            )
        if self.faults:
            raise UsageError(
                "--robot-fault is for --robot inline and stub; for others, give --fault to "
                "spikeport robot serve"
            )

    @property
    def is_made_for_the_run(self) -> bool:
        """True if the robot is simulated in this process, or in one of its own."""
        return self.robot in (INLINE, STUB)

    @property
    def estimates(self) -> str:
        """The estimator's name."""
        if self.estimator is not None:
            return self.estimator
        return TRUTH if self.is_made_for_the_run else EKF

    @property
    def by_hand(self) -> bool:
        """True if a run over DDS begins in the states before ``RUN``."""
        # A real robot that may listen moves only once its user starts it.
        return self.real_time and (self.states or self.may_be_real)

    @property
    def may_be_real(self) -> bool:
        """True if the robot may be a real one."""
        return not self.is_made_for_the_run and self.place.may_be_real

    @property
    def place(self) -> Place:
        """The place of the robot; raises UsageError if the text names none."""
        found = re.fullmatch(r"dds:(?P<interface>[^:]+):(?P<domain>[0-9]{1,3})", self.robot)
        if found is None:
            raise UsageError(f"--robot {self.robot!r}: write {FORMS}")
        return Place(found["interface"], int(found["domain"]))


def connect(options: RobotOptions, settings: RobotSettings, *, paced: bool = False) -> RobotClient:
    """Return a robot to control.

    Parameters
    ----------
    options : RobotOptions
        The robot to connect with.
    settings : RobotSettings
        The settings of a robot that is made for the run; an existing robot has its own.
    paced : bool
        True if a board in real time paces the run, too; see `spikeport.pacing.Pace`.

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
    needs = needed(options.estimates)
    if needs is ODOMETRY:
        settings = dataclasses.replace(settings, odometer=OdometerErrors())
    if options.robot == INLINE:
        faults = [FAULTS.parse(text) for text in options.faults]
        return InlineRobot(LockStep(SimulatedRobot(settings), faults))
    pace = None
    if options.real_time:
        pace = Pace(1 / settings.rate_hz, priority=options.priority, shared=paced)
    if options.robot == STUB:
        # The stub always publishes its truth, by which a run is judged: wait for it, unless the
        # estimator needs odometry.
        return StubRobot(settings, pace, options.faults, needs or TRUTHS)
    if pace is not None and options.by_hand:
        return join_by_hand(options.place, pace, needs)
    return join(options.place, pace, needs)
