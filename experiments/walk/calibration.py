"""The read-out of a trial's policy, refitted to its spikes, or taken from a file."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from spikeport.experiments.calibration import Calibration, load
from spikeport.experiments.policy.calibration import calibrated_readout
from spikeport.experiments.walk.gait import record_gait
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.networks.policy import Layer, Ranges, Readout, record_ranges
from spikeport.networks.walking_policy import WalkingPolicy


def policy_layers(weights: WalkingPolicy) -> list[Layer]:
    """The layers of a policy."""
    return [Layer(W, b) for W, b in zip(weights.weights, weights.biases, strict=True)]


def readout(
    trial: WalkTrial, layers: Sequence[Layer], ranges: Sequence[Ranges], gait: np.ndarray
) -> Readout | None:
    """The read-out that a trial asks for; None for that of the policy itself.

    Raises
    ------
    UsageError
        If it is to come from a file that was made for anything else.
    """
    given = trial.settings.calibrated
    if isinstance(given, str):
        return Readout(**load(Path(given), _made_for(trial, layers)).decoders)
    return Readout(**_refitted(trial, layers, ranges, gait).decoders) if given else None


def calibrate(trial: WalkTrial) -> Calibration:
    """Refit the read-out of a trial's policy to its spikes on the trial's backend."""
    weights = trial.settings.walking_policy()
    trial.options.progress("recording the gait of the exact policy", None)
    layers, gait = policy_layers(weights), record_gait(weights)
    return _refitted(trial, layers, record_ranges(layers, gait), gait)


def _refitted(
    trial: WalkTrial, layers: Sequence[Layer], ranges: Sequence[Ranges], gait: np.ndarray
) -> Calibration:
    settings, options = trial.settings, trial.options
    found = calibrated_readout(
        layers, ranges, settings.policy_options, gait, options, settings.network_seed
    )
    return Calibration(_made_for(trial, layers), found.image_digest, found.decoders)


def _made_for(trial: WalkTrial, layers: Sequence[Layer]) -> dict[str, Any]:
    """All that the neurons of the trial's policy depend on."""
    settings = trial.settings
    arrays = [array for layer in layers for array in (layer.weights, layer.bias)]
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays))
    names = ("n_neurons", "tau_fwd", "tau_out", "network_seed")
    network = {name: getattr(settings, name) for name in names}
    policy = {"policy": digest.hexdigest()[:12]}
    return {"experiment": trial.name, **policy, **network, **trial.options.substrate}
