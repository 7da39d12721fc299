"""Reach-to-target: the right arm follows random targets (paper, sec. 4.1 and Fig. 3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from spikeport.experiments.arm import reach_task
from spikeport.experiments.arm.figures import reach_figure
from spikeport.experiments.arm.metrics import reach_metrics
from spikeport.experiments.arm.reach_task import ReachTask, TargetBox, find_box
from spikeport.experiments.arm.recording import ArmRun
from spikeport.experiments.arm.region import Rehearsal
from spikeport.experiments.arm.settings import ArmSettings
from spikeport.experiments.arm.trial import ArmTrial
from spikeport.experiments.options import BACKENDS, Experiment
from spikeport.experiments.run_folder import Result

CHECKED_M = 0.1
"""The largest distance between points of a box that must be reachable: around the shoulder, and in
the trunk, places between reachable corners are out of reach."""
TRACE_S = 1.0
"""The length of the trace in pictures."""


@dataclass(frozen=True, kw_only=True)
class ReachSettings(ArmSettings):
    """Settings of the experiment, see `ArmSettings`.

    ``box`` is the box in which targets appear: ``small``, ``large`` or ``x0:x1,y0:y1,z0:z1`` in m,
    in the world's frame: from the floor below the pelvis, x forwards, y to the left and z up.
    """

    box: str = "small"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        super().__post_init__()
        find_box(self.box)

    @property
    def target_box(self) -> TargetBox:
        """The box in which targets appear."""
        return find_box(self.box)


class ReachTrial(ArmTrial):
    """A reach run."""

    settings: ReachSettings
    name = "reach"

    def task(self, hand: np.ndarray) -> ReachTask:
        """Return random targets, drawn from the seed of the run."""
        return ReachTask(self.settings.target_box, self.options.seed, hand)

    def rehearsals(self) -> list[Rehearsal]:
        """Return a tour of the box, and random targets."""
        return reach_task.rehearsals(self.settings.target_box)

    @property
    def rehearsed_settings(self) -> dict[str, object]:
        """The box."""
        return {"box": self.settings.box}

    @property
    def rehearsed_values(self) -> dict[str, object]:
        """The edges of the box, which several texts may name."""
        return {"box": self.settings.target_box}

    @property
    def goal(self) -> str:
        """The box."""
        return f"box {self.settings.box}"

    def goal_points(self) -> np.ndarray:
        """Return points that fill the box."""
        return self.settings.target_box.grid(3, CHECKED_M)

    def trace_since(self, time_s: float) -> float:
        """Return the time at which the last second begins."""
        return time_s - TRACE_S

    def metrics(self, run: ArmRun) -> dict[str, object]:
        """Return the figures of a run."""
        assert isinstance(run.task, ReachTask)
        return reach_metrics(run, run.task.reach_times_s)

    def amounts(self, run: ArmRun) -> Mapping[str, float]:
        """Return the reaches."""
        assert isinstance(run.task, ReachTask)
        return {"reach": len(run.task.reach_times_s)}

    def figure(self, run: ArmRun, pictures: Sequence[np.ndarray], result: Result) -> Figure:
        """Draw the paper's Fig. 3."""
        return reach_figure(run, pictures, result)


EXPERIMENT = Experiment(
    trial=ReachTrial,
    settings=ReachSettings,
    backends=BACKENDS,
    seconds=15.0,
    shortest_s=0.005,
)
