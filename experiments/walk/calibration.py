"""What a walking policy is calibrated by, to be kept in a file."""

from spikeport.experiments.calibration import Calibration
from spikeport.experiments.policy.readout import policy_layers, refitted
from spikeport.experiments.walk.gait import WALKS, record_gait
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.networks.policy import record_ranges


def calibrate(trial: WalkTrial) -> Calibration:
    """Fit a trial's policy to its spikes on the trial's backend."""
    weights = trial.settings.walking_policy()
    trial.options.progress("recording the gait of the exact policy", None)
    layers, gait = policy_layers(weights), record_gait(weights)
    return refitted(trial, layers, record_ranges(layers, gait), gait, WALKS)
