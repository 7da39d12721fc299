"""The goal of a phase: a path to walk, or a task of the arm.

A path p(t) is walked from standing to standing, as p(w(t)) with

    dw/dt = min(1, t / t_r, (T - t) / t_r)

where T is the time for which the reference moves: that of the phase and of the reference's lead.

Hand and targets are in the frames of the arm (`spikeport.experiments.switch.frames`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from spikeport.errors import UsageError
from spikeport.experiments.arm.draw_task import DrawTask, Sheet, Way
from spikeport.experiments.arm.reach_task import BOXES, ReachTask
from spikeport.experiments.arm.recording import ArmTask
from spikeport.experiments.curves import minimum_jerk
from spikeport.experiments.switch.schedule import Phase, Schedule
from spikeport.experiments.walk.paths import WalkPath, find_path
from spikeport.experiments.walk.port import LEAD_S
from spikeport.robot.arm import ArmDynamics
from spikeport.robot.description import ARM_POSE_RAD

RAMP_S = 1.0
"""Time in which a walk reaches its speed, and in which it ends."""
PATH_DT_S = 0.02
RETRACT_REST_S = 0.5
"""The last part of a phase that retracts the arm, in which the hand comes to rest."""
BOX = BOXES["small"]
"""The box in which targets of a reach phase appear."""


@dataclass(frozen=True)
class Goal:
    """A phase, with the path to walk from the robot's place, or None if the arm works.

    ``digit`` is the digit of a drawing phase, ``seed`` (of the run, and the phase's number) draws
    the targets of a reach phase.
    """

    phase: Phase
    path: WalkPath | None
    digit: int
    seed: tuple[int, int]

    def task(self, hand: np.ndarray) -> ArmTask | None:
        """Return the task of the arm, whose hand is at (3,) in m; None while the robot walks."""
        if self.phase.arm == "digit":
            return DrawTask(self.stroke, hand, self.phase.seconds)
        if self.phase.arm == "retract":
            return RetractTask(hand, self.phase.seconds)
        if self.phase.arm == "reach":
            return ReachTask(BOX, self.seed, hand)
        return None

    @property
    def stroke(self) -> np.ndarray:
        """The template of a drawing phase, (n, 3)."""
        return Sheet().stroke(self.digit)


def find_goals(schedule: Schedule, digit: int, seed: int) -> list[Goal]:
    """Return the goals of all phases.

    Raises
    ------
    UsageError
        If a path cannot be read or followed.
    """
    phases = enumerate(schedule.phases)
    return [Goal(phase, _path(phase), digit, (seed, number)) for number, phase in phases]


def _path(phase: Phase) -> WalkPath | None:
    if phase.path is None:
        return None
    # The reference is ahead of the robot by the lead, so it moves for longer than the phase.
    seconds = phase.seconds + LEAD_S
    try:
        whole = find_path(phase.path, phase.speed_m_s, seconds)
    except UsageError as error:
        raise UsageError(f"phase '{phase.name}': {error}") from None
    return from_stand_to_stand(whole, seconds)


def from_stand_to_stand(path: WalkPath, seconds: float) -> WalkPath:
    """Return the part of a path that is walked in a time, with ramps of speed at both ends."""
    times = np.linspace(0, seconds, 1 + round(seconds / PATH_DT_S))
    # A short phase has only ramps: it speeds up for half of its time, and then slows down.
    ramp_s = min(RAMP_S, seconds / 2)
    speed = np.clip(np.minimum(times, seconds - times) / ramp_s, 0, 1)
    walked_s = cumulative_trapezoid(speed, times, initial=0)
    return WalkPath(times, np.array([path.at(t)[:2] for t in walked_s]))


def hanging_hand() -> np.ndarray:
    """Return the place (3,) of the right hand while the arm hangs as in walking, in m."""
    return ArmDynamics().at(ARM_POSE_RAD).position


class RetractTask(Way):
    """A smooth move of the hand back to its place while walking.

    Parameters
    ----------
    hand : (3,) array
        The hand's place at the start, in m.
    seconds : float
        Time of the whole phase.
    """

    def __init__(self, hand: np.ndarray, seconds: float) -> None:
        self.end = hanging_hand()
        share = minimum_jerk(seconds - RETRACT_REST_S)
        super().__init__(np.vstack([hand + np.outer(share, self.end - hand), self.end]))
