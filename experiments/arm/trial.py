"""What a run of the arm leaves, and what each of its experiments says about itself."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from spikeport.experiments.arm.loop import Recording
from spikeport.experiments.arm.settings import ArmSettings
from spikeport.experiments.arm.task import Rehearsal, Task
from spikeport.experiments.options import Options
from spikeport.simulator import Simulator


class ArmRun(NamedTuple):
    """A run that is over."""

    task: Task
    recording: Recording
    exact: np.ndarray
    """(n, 4) torques of the exact law at the recorded states, in N m."""
    at_limit: np.ndarray
    """(n,) whether a joint was at its lowest or highest angle."""
    rasters: dict[str, np.ndarray]
    """(n_steps, n_neurons) spikes of some M1 neurons, by axis; empty without neurons."""
    sim: Simulator
    wall_s: float
    picture: np.ndarray | None = None
    """(height, width, 3) the robot at the end; None until drawn, and without graphics."""


@dataclass(frozen=True)
class ArmTrial(ABC):
    """What one experiment of the arm does differently from the others."""

    settings: ArmSettings
    options: Options

    name = ""

    @abstractmethod
    def task(self, hand: np.ndarray) -> Task:
        """What the arm does, its hand being at (3,) in m."""

    @abstractmethod
    def rehearsals(self) -> Iterable[Rehearsal]:
        """Runs of the exact law that show which states the task needs."""

    @property
    def network_settings(self) -> dict[str, Any]:
        """The settings that the controller depends on."""
        sizes = dataclasses.asdict(self.settings.sizes)
        return {**sizes, "network_seed": self.settings.network_seed}

    @property
    @abstractmethod
    def goal(self) -> str:
        """What is to be reached or drawn, for messages."""

    @abstractmethod
    def goal_points(self) -> np.ndarray:
        """(n, 3) points in m that the hand must be able to take."""

    @abstractmethod
    def metrics(self, run: ArmRun) -> dict[str, Any]:
        """The figures of a run."""

    @abstractmethod
    def figure(self, run: ArmRun, result: dict[str, Any]) -> Figure:
        """The picture of a run; ``result`` is what ``result.json`` will hold."""

    @abstractmethod
    def trace_since(self, time_s: float) -> float:
        """From when on the hand's trace is shown in a picture of a moment."""
