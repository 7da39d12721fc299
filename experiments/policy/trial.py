"""The part of a trial that walking and switching share: a policy walks a robot."""

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np

from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.policy.calibration import Walks
from spikeport.experiments.policy.readout import check_calibrated, check_neurons, refitted
from spikeport.experiments.policy.settings import OF_NEURONS, PolicySettings
from spikeport.experiments.trial import WITHOUT_NEURONS_UNUSED, Rig, Trial
from spikeport.networks.policy import record_ranges
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.robot.perturbation import Perturbation
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.simulator import Simulator


class Walked(Protocol):
    """A recording of a robot that walked."""

    @property
    def walked_m(self) -> float:
        """Length of the way, in m."""


class LegsRun(Protocol):
    """A run in which a robot walked."""

    @property
    def recording(self) -> Walked:
        """The recording of the legs."""

    @property
    def sim(self) -> Simulator:
        """The simulator that ran."""


K = TypeVar("K", bound=Rig)
R = TypeVar("R", bound=LegsRun)


class LegsTrial(Trial[K, R]):
    """A run in which a policy, exact or of neurons, walks a robot."""

    settings: PolicySettings

    @property
    @abstractmethod
    def recorded(self) -> dict[str, object]:
        """Everything that the policy's recorded observations depend on, besides the policy."""

    @cached_property
    def walking_policy(self) -> WalkingPolicy:
        """The exact policy; raises UsageError if it is for another robot."""
        return self.settings.walking_policy()

    @property
    def perturbation(self) -> Perturbation:
        """The perturbation that the settings ask for."""
        return self.settings.perturbation

    def check(self) -> None:
        """Refuse a policy or calibration that does not fit, and all that any trial refuses.

        Reading a policy takes longest, so that subclasses check their own settings before.
        """
        super().check()
        check_neurons(self)
        check_calibrated(self, self.walking_policy)

    @property
    def unused(self) -> dict[str, str]:
        """The settings that do nothing in this run, each with the reason and a cure."""
        found = super().unused
        if not self.options.has_neurons:
            found |= dict.fromkeys(OF_NEURONS, WITHOUT_NEURONS_UNUSED)
        return found

    @abstractmethod
    def gait_and_walks(self) -> tuple[np.ndarray, Walks]:
        """Return observations (n, 69) of the exact policy, and the walks that calibrate neurons."""

    def calibrate(self) -> DecoderCalibration:
        """Fit the policy's read-out to the spikes of its neurons on the backend."""
        layers, (gait, walks) = self.walking_policy.layers, self.gait_and_walks()
        return refitted(self, layers, record_ranges(layers, gait), gait, walks)

    def amounts(self, run: R) -> Mapping[str, float]:
        """Return metres walked and periods of the policy."""
        return {"metre": run.recording.walked_m, "policy period": run.sim.time / CONTROL_DT_S}
