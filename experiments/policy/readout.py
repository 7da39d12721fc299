"""The calibration of a trial's policy: fitted on its backend, or read from a file."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from spikeport.cache import Arrays
from spikeport.experiments.calibration import DecoderCalibration, Refitted, load, no_neurons
from spikeport.experiments.options import Options
from spikeport.experiments.policy.calibration import METHOD, Walks, calibrated_policy
from spikeport.experiments.policy.settings import AUTO, EXACT, PolicySettings
from spikeport.hardware_models import chip as chips
from spikeport.networks.policy import Calibrated, Layer, Ranges
from spikeport.networks.policy_solving import by_halves
from spikeport.networks.walking_policy import WalkingPolicy


class PolicyTrial(Protocol):
    """A run in which a policy of neurons walks the robot."""

    @property
    def settings(self) -> PolicySettings:
        """Settings of the policy, among others."""

    @property
    def options(self) -> Options:
        """Chip, backend and passes, among others."""

    @property
    def recorded(self) -> dict[str, object]:
        """Everything that the policy's recorded observations depend on."""


def check_neurons(trial: PolicyTrial) -> None:
    """Refuse to calibrate a trial's policy that has no neurons."""
    wanted = trial.settings.calibrated
    if wanted in (False, AUTO):
        return
    if not trial.options.has_neurons:
        raise no_neurons(wanted, "backend 'analytic'", "give --backend native")
    if trial.settings.policy == EXACT:
        raise no_neurons(wanted, f"policy={EXACT}", "give --set policy=spiking")


def check_calibrated(trial: PolicyTrial, policy: WalkingPolicy) -> None:
    """Refuse a calibration file that does not fit a trial's policy, see `calibrated`."""
    wanted = _asked(trial)
    if isinstance(wanted, str):
        _loaded(wanted, trial, policy.layers)


def _asked(trial: PolicyTrial) -> bool | str:
    """Return whether the policy is calibrated, or the file of its calibration."""
    wanted = trial.settings.calibrated
    # Float neurons behave as their decoders were solved for.
    return trial.options.backend != "reference" if wanted == AUTO else wanted


def policy_digest(layers: Sequence[Layer]) -> str:
    """Return twelve digits that differ from policy to policy."""
    arrays = [array for layer in layers for array in (layer.weights, layer.bias)]
    found = hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays))
    return found.hexdigest()[:12]


def calibrated(
    trial: PolicyTrial,
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    gait: np.ndarray,
    walks: Walks,
) -> Calibrated | None:
    """Return the calibration a trial asks for; None for the policy as it is.

    Parameters
    ----------
    trial : PolicyTrial
        The trial, with the read-out it asks for.
    layers, ranges
        The arguments of `spikeport.networks.policy.policy`.
    gait : (n, 69) array
        Recorded observations.
    walks : Walks
        The walks of the robot.

    Raises
    ------
    UsageError
        If it is to come from a file that was made for something else.
    """
    wanted = _asked(trial)
    if isinstance(wanted, str):
        return Calibrated(**_loaded(wanted, trial, layers).decoders)
    return Calibrated(**refitted(trial, layers, ranges, gait, walks).decoders) if wanted else None


def refitted(
    trial: PolicyTrial,
    layers: Sequence[Layer],
    ranges: Sequence[Ranges],
    gait: np.ndarray,
    walks: Walks,
) -> DecoderCalibration:
    """Return the calibration of a trial's policy, found on the trial's backend."""
    settings, options = trial.settings, trial.options

    def refit() -> Arrays:
        return calibrated_policy(
            layers, ranges, settings.policy_options, gait, walks, options, settings.network_seed
        ).arrays()

    made_for = _made_for(trial, layers)
    inputs = (made_for, chips.get(options.chip), layers, ranges, gait)
    return Refitted.of(options.cache.kept("policy", inputs, refit)).made_for(made_for)


def _loaded(file: str, trial: PolicyTrial, layers: Sequence[Layer]) -> DecoderCalibration:
    """Return the calibration in a file, which must be one of the trial's policy."""
    readout = by_halves(layers[-1], trial.settings.policy_options)
    shapes = {
        "weights": readout.weights.shape,
        "bias": readout.bias.shape,
        "trim": layers[0].weights.shape[1:],
    }
    return load(Path(file), _made_for(trial, layers), shapes)


def _made_for(trial: PolicyTrial, layers: Sequence[Layer]) -> dict[str, object]:
    """Return everything that the policy's neurons depend on, and the method of refitting."""
    settings = trial.settings
    network = {**settings.conversion, "network_seed": settings.network_seed}
    policy = {"policy": policy_digest(layers), "method": METHOD}
    return {**trial.recorded, **policy, **network, **trial.options.substrate}
