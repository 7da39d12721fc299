"""The read-out of a trial's policy, refitted to its spikes, or taken from a file."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from spikeport.experiments.calibration import Calibration, load
from spikeport.experiments.options import Options
from spikeport.experiments.policy.calibration import METHOD, Policy, calibrated_readout
from spikeport.experiments.policy.settings import AUTO, PolicySettings
from spikeport.networks.policy import Layer, Ranges, Readout
from spikeport.networks.walking_policy import WalkingPolicy


class PolicyTrial(Protocol):
    """A run in which a policy of neurons walks the robot."""

    @property
    def settings(self) -> PolicySettings:
        """Those of the policy, among others."""

    @property
    def options(self) -> Options:
        """Chip, backend and passes, among others."""

    @property
    def recorded(self) -> dict[str, Any]:
        """What the observations depend on that the policy's neurons are made for."""


def policy_layers(weights: WalkingPolicy) -> list[Layer]:
    """The layers of a policy."""
    return [Layer(W, b) for W, b in zip(weights.weights, weights.biases, strict=True)]


def check_readout(trial: PolicyTrial, weights: WalkingPolicy) -> None:
    """Refuse a file that no read-out for a trial's policy can be taken from, see `readout`."""
    given = _calibrated(trial)
    if isinstance(given, str):
        load(Path(given), _made_for(trial, policy_layers(weights)))


def _calibrated(trial: PolicyTrial) -> bool | str:
    """Whether the read-out is refitted, or the file it comes from."""
    given = trial.settings.calibrated
    return trial.options.backend != "reference" if given == AUTO else given


def policy_digest(layers: Sequence[Layer]) -> str:
    """Twelve digits that differ from policy to policy."""
    arrays = [array for layer in layers for array in (layer.weights, layer.bias)]
    found = hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays))
    return found.hexdigest()[:12]


def readout(
    trial: PolicyTrial,
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    gait: np.ndarray,
    walk: Callable[[Policy], np.ndarray],
) -> Readout | None:
    """The read-out that a trial asks for; None for that of the policy itself.

    Parameters
    ----------
    trial : PolicyTrial
        What is asked for.
    layers, ranges
        Those of the policy, as `spikeport.networks.policy.policy` takes them.
    gait : (n, 69) array
        Recorded observations.
    walk : callable
        See `experiments.policy.calibration.calibrated_readout`.

    Raises
    ------
    UsageError
        If it is to come from a file that was made for anything else.
    """
    given = _calibrated(trial)
    if isinstance(given, str):
        return Readout(**load(Path(given), _made_for(trial, layers)).decoders)
    return Readout(**refitted(trial, layers, ranges, gait, walk).decoders) if given else None


def refitted(
    trial: PolicyTrial,
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    gait: np.ndarray,
    walk: Callable[[Policy], np.ndarray],
) -> Calibration:
    """The read-out of a trial's policy, refitted to its spikes on the trial's backend."""
    settings, options = trial.settings, trial.options
    found = calibrated_readout(
        layers, ranges, settings.policy_options, gait, walk, options, settings.network_seed
    )
    return Calibration(_made_for(trial, layers), found.image_digest, found.decoders)


def _made_for(trial: PolicyTrial, layers: Sequence[Layer]) -> dict[str, Any]:
    """All that the neurons of the trial's policy depend on, and how they are refitted."""
    settings = trial.settings
    network = {**settings.conversion, "network_seed": settings.network_seed}
    policy = {"policy": policy_digest(layers), "method": METHOD}
    return {**trial.recorded, **policy, **network, **trial.options.substrate}
