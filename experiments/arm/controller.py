"""The spiking controller of a trial, from its settings and the region its task needs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from spikeport.experiments.arm.calibration import draw_states, refit
from spikeport.experiments.arm.reachability import check_sampled
from spikeport.experiments.arm.region import record_region
from spikeport.experiments.arm.settings import ArmSettings
from spikeport.experiments.arm.trial import ArmTrial
from spikeport.experiments.calibration import Calibration, load
from spikeport.experiments.closed_loop import DT_S
from spikeport.networks.arm import ArmNetwork, arm
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.arm import ArmDynamics


def controller(
    settings: ArmSettings, region: ArmRegion, decoders: Mapping[str, np.ndarray] | None = None
) -> ArmNetwork:
    """The controller; ``decoders`` replace those solved for float neurons."""
    law = OperationalSpaceLaw(ArmDynamics())
    return arm(law, region, settings.sizes, seed=settings.network_seed, decoders=decoders)


def spiking_controller(trial: ArmTrial, law: OperationalSpaceLaw) -> ArmNetwork:
    """Rehearse the task, and build the controller for the states it needs.

    Raises
    ------
    UsageError
        If a point of the trial's goal is not among those states, or the trial's calibration was
        made for another controller.
    """
    given = trial.settings.calibrated
    calibration = load(Path(given), _made_for(trial)) if isinstance(given, str) else None
    region = _rehearsed(trial, law)
    if given is True:
        calibration = _calibrated(trial, law, region)
    trial.options.progress("building the controller", None)
    decoders = None if calibration is None else calibration.decoders
    return controller(trial.settings, region, decoders)


def calibrate(trial: ArmTrial) -> Calibration:
    """Refit the decoders of a trial's controller to what its neurons do on the trial's backend."""
    law = OperationalSpaceLaw(ArmDynamics())
    return _calibrated(trial, law, _rehearsed(trial, law))


def _rehearsed(trial: ArmTrial, law: OperationalSpaceLaw) -> ArmRegion:
    trial.options.progress("rehearsing with the exact law", None)
    region = record_region(law, trial.rehearsals())
    check_sampled(trial.goal, trial.goal_points(), region)
    return region


def _calibrated(trial: ArmTrial, law: OperationalSpaceLaw, region: ArmRegion) -> Calibration:
    built = controller(trial.settings, region)
    refitted = refit(built, draw_states(law, region), trial.options, DT_S)
    return Calibration(_made_for(trial), refitted.image_digest, refitted.decoders)


def _made_for(trial: ArmTrial) -> dict[str, Any]:
    """All that the trial's controller and its neurons depend on."""
    return {"experiment": trial.name, **trial.network_settings, **trial.options.substrate}
