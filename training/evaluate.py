"""An evaluation of a policy: falls and errors of speed in random episodes of 20 s."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, fields, replace

import numpy as np

from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.training.environment import EPISODE_STEPS, TrainingTask, WalkEnvironment
from spikeport.training.rewards import Weights

BatchPolicy = Callable[[np.ndarray], np.ndarray]
"""Actions ``(n, 19)`` for observations ``(n, 69)``."""

SETTLING_S = 1.0
"""Time after a change of command in which errors are not counted."""

SMOOTHING_S = 0.2
"""Speeds are averaged over this time before they are compared."""


NO_REWARDS = Weights(**{term.name: 0.0 for term in fields(Weights)})
"""Weights with which no term of the reward is computed, since an evaluation uses none."""


@dataclass(frozen=True)
class Evaluation:
    """The outcome of an evaluation.

    ``fallen`` of ``episodes`` robots fell; the errors are means of |vx* - vx| and |wz* - wz|, of
    the present command and the mean speed of the last 0.2 s, 1 s after each change of command left
    out; ``clearance_m`` is the mean height of a foot's highest point in a step, ``steps_per_s`` the
    rate of touch-downs, both while commanded to walk ahead at more than 0.2 m/s;
    ``standing_steps_per_s`` is that rate while commanded to stand. The measures of
    `spikeport.experiments.evaluate` have other rules: they do not compare with these.
    """

    episodes: int
    fallen: int
    vx_error_m_s: float
    wz_error_rad_s: float
    clearance_m: float
    steps_per_s: float
    standing_steps_per_s: float


def evaluate(
    policy: BatchPolicy, task: TrainingTask, *, episodes: int = 100, seed: int = 0, threads: int = 2
) -> Evaluation:
    """Let a policy walk ``episodes`` robots for 20 s, as many at once, physics in ``threads``."""
    tally, unrewarded = Tally(episodes), replace(task, weights=NO_REWARDS)
    with closing(WalkEnvironment(episodes, unrewarded, seed, threads)) as env:
        for _ in range(EPISODE_STEPS):
            fallen = env.step(policy(env.observe())).fallen
            tally.add(env, fallen)
    return tally.result()


class Tally:
    """Sums over the steps of robots that have not fallen."""

    def __init__(self, n: int) -> None:
        self._up = np.ones(n, bool)
        self._recent: list[np.ndarray] = []
        self._errors: list[np.ndarray] = []
        self._peak_m = np.zeros((n, 2))
        self._walking, self._standing = _Footsteps(), _Footsteps()

    def add(self, env: WalkEnvironment, fallen: np.ndarray) -> None:
        """Count one control step."""
        self._up &= ~fallen
        motion, command = env.motion, env.commands
        settled = self._up & (command.age_s > SETTLING_S)
        speed = np.stack((motion.level_velocity[:, 0], motion.yaw_rate), axis=1)
        self._recent = [*self._recent, speed][-round(SMOOTHING_S / CONTROL_DT_S) :]
        error = np.abs(command.value[:, [0, 2]] - np.mean(self._recent, axis=0))
        self._errors.append(error[settled])
        self._peak_m = np.maximum(self._peak_m, env.feet.height_m)
        down = env.gait.touched_down
        self._walking.add(self._up & (command.value[:, 0] > 0.2), down, self._peak_m)
        self._standing.add(settled & ~command.value.any(axis=1), down, self._peak_m)
        self._peak_m[down] = 0.0

    def result(self) -> Evaluation:
        """Return the figures; without anything to count, errors are infinite and heights 0."""
        errors, peaks = np.concatenate(self._errors), self._walking.peaks_m
        vx, wz = errors.mean(axis=0) if len(errors) else (np.inf, np.inf)
        return Evaluation(
            episodes=len(self._up),
            fallen=int(np.count_nonzero(~self._up)),
            vx_error_m_s=float(vx),
            wz_error_rad_s=float(wz),
            clearance_m=float(peaks.mean()) if len(peaks) else 0.0,
            steps_per_s=self._walking.per_s,
            standing_steps_per_s=self._standing.per_s,
        )


class _Footsteps:
    """The steps of some of the robots: their rate and their heights."""

    def __init__(self) -> None:
        self._robots = 0
        self._peaks: list[np.ndarray] = []

    def add(self, which: np.ndarray, down: np.ndarray, peak_m: np.ndarray) -> None:
        """Count the feet of robots ``which (n,)`` that touch down, ``(n, 2)``."""
        self._robots += int(np.count_nonzero(which))
        self._peaks.append(peak_m[down & which[:, None]])

    @property
    def peaks_m(self) -> np.ndarray:
        """The highest point of every step."""
        return np.concatenate(self._peaks)

    @property
    def per_s(self) -> float:
        """Steps of one robot in a second."""
        return len(self.peaks_m) / (max(self._robots, 1) * CONTROL_DT_S)
