"""The spiking controller of a trial, from its settings and the region its task needs."""

import functools
from collections.abc import Mapping

import numpy as np

from spikeport.experiments.arm_calibration import draw_states, refit
from spikeport.experiments.arm_reach import check_sampled
from spikeport.experiments.arm_region import record_region
from spikeport.experiments.arm_settings import ArmSettings
from spikeport.experiments.arm_trial import ArmTrial
from spikeport.networks.arm import ArmNetwork, arm
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.networks.region import ArmRegion
from spikeport.robot.arm import ArmDynamics

DT_S = 0.001


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
        If a point of the trial's goal is not among those states.
    """
    settings, options = trial.settings, trial.options
    options.progress("rehearsing with the exact law", None)
    region = record_region(law, trial.rehearsals())
    check_sampled(trial.goal, trial.goal_points(), region)
    options.progress("building the controller", None)
    build = functools.partial(controller, settings, region)
    if not settings.calibrated:
        return build()
    return build(refit(build(), draw_states(law, region), options, DT_S))
