"""A walking run: what it is asked for, and what it leaves."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from spikeport.experiments.options import Options
from spikeport.experiments.walk.loop import LEAD_S
from spikeport.experiments.walk.paths import Path, find_path
from spikeport.experiments.walk.recording import Recording
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.networks.region import Box
from spikeport.simulator import Simulator


@dataclass(frozen=True)
class WalkTrial:
    """Settings and options of a run."""

    settings: WalkSettings
    options: Options
    name = "walk"

    @property
    def recorded(self) -> dict[str, Any]:
        """What the recorded gait depends on, beside the policy."""
        return {"experiment": self.name}

    @property
    def exact_policy(self) -> bool:
        """Whether the policy is computed without neurons."""
        return self.options.backend == "analytic" or self.settings.policy == "mlp"

    @property
    def exact_follower(self) -> bool:
        """Whether the path follower is computed without neurons."""
        return self.options.backend == "analytic" or self.settings.follower == "exact"

    def path(self) -> Path:
        """The path, for as long as the run takes.

        Raises
        ------
        UsageError
            If there is none of that name, or the robot cannot follow it.
        """
        settings = self.settings
        return find_path(settings.path, settings.speed, self.options.seconds + LEAD_S)


class WalkRun(NamedTuple):
    """A run that is over."""

    path: Path
    seconds: float
    """For how long it was to go on."""
    recording: Recording
    fallen_at_s: float | None
    encoding: Box | None
    """Range of what the policy can be told; None where that is exact."""
    sim: Simulator
    wall_s: float
    spikes: np.ndarray | None = None
    """(n_steps, n) spikes of some neurons of the policy; None where none are kept."""
    picture: np.ndarray | None = None
    """(height, width, 3) the robot at the end; None until drawn, and without graphics."""
