"""Reach-to-target: the right arm follows random targets (paper, sec. 4.1 and Fig. 4)."""

from dataclasses import dataclass
from typing import Any

import nengo
import numpy as np
from matplotlib.figure import Figure

from spikeport.experiments.arm import controller as arm_controller
from spikeport.experiments.arm import reach_task
from spikeport.experiments.arm import run as arm_run
from spikeport.experiments.arm.reach_figure import reach_figure
from spikeport.experiments.arm.reach_metrics import metrics
from spikeport.experiments.arm.reach_task import ReachTask, TargetBox, find_box
from spikeport.experiments.arm.settings import ArmSettings
from spikeport.experiments.arm.task import Rehearsal
from spikeport.experiments.arm.trial import ArmRun, ArmTrial
from spikeport.experiments.calibration import Calibration
from spikeport.experiments.closed_loop import BACKENDS
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.arm import ArmDynamics

TRACE_S = 1.0
"""How long a trace pictures show."""


@dataclass(frozen=True, kw_only=True)
class ReachSettings(ArmSettings):
    """Settings of the experiment, see `ArmSettings`.

    ``box`` is where targets appear: ``small``, ``large`` or ``x0:x1,y0:y1,z0:z1`` in m.
    """

    box: str = "small"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        super().__post_init__()
        find_box(self.box)

    @property
    def target_box(self) -> TargetBox:
        """Where targets appear."""
        return find_box(self.box)


@dataclass(frozen=True)
class ReachTrial(ArmTrial):
    """What a reach run does, and what is made of it."""

    settings: ReachSettings
    name = "reach"

    def task(self, hand: np.ndarray) -> ReachTask:
        """Random targets, drawn from the seed of the run."""
        return ReachTask(self.settings.target_box, self.options.seed, hand)

    def rehearsals(self) -> list[Rehearsal]:
        """A tour of the box, and random targets."""
        return reach_task.rehearsals(self.settings.target_box)

    @property
    def network_settings(self) -> dict[str, Any]:
        """The box besides."""
        return {**super().network_settings, "box": self.settings.box}

    @property
    def goal(self) -> str:
        """The box."""
        return f"box {self.settings.box}"

    def goal_points(self) -> np.ndarray:
        """Points that fill the box."""
        return self.settings.target_box.grid(3)

    def metrics(self, run: ArmRun) -> dict[str, Any]:
        """The figures of a run."""
        assert isinstance(run.task, ReachTask)
        return metrics(run, run.task.reach_times_s)

    def figure(self, run: ArmRun, result: dict[str, Any]) -> Figure:
        """The paper's Fig. 4."""
        return reach_figure(run, result)

    def trace_since(self, time_s: float) -> float:
        """The last second."""
        return time_s - TRACE_S


def network(settings: ReachSettings, options: Options) -> nengo.Network:
    """The spiking controller for one target box."""
    law = OperationalSpaceLaw(ArmDynamics())
    built = arm_controller.spiking_controller(ReachTrial(settings, options), law)
    with nengo.Network(label=ReachTrial.name, seed=settings.network_seed) as network:
        network.add(built)
        nengo.Probe(built.torque)  # what leads nowhere is not compiled
    return network


def calibrate(settings: ReachSettings, options: Options) -> Calibration:
    """Refit the controller's decoders where it runs."""
    return arm_controller.calibrate(ReachTrial(settings, options))


def run(settings: ReachSettings, options: Options) -> Outcome:
    """Run the experiment and write its folder."""
    return arm_run.run(ReachTrial(settings, options))


EXPERIMENT = Experiment(
    name=ReachTrial.name,
    summary="the right arm follows random targets",
    settings=ReachSettings,
    run=run,
    backends=BACKENDS,
    seconds=15.0,
    shortest_s=0.005,
    calibrate=calibrate,
    network=network,
)
