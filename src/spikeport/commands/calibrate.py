"""``spikeport calibrate``."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import fields

from spikeport.atomic import check_output
from spikeport.commands.checks import check_needed, check_target, seconds_of
from spikeport.commands.console import line_console
from spikeport.commands.options_of_experiments import CalibrateRequest
from spikeport.commands.progress import progress_bar
from spikeport.compile.check.lost_values import cut_off_by_design
from spikeport.errors import UsageError, unknown
from spikeport.experiments import registry
from spikeport.experiments.calibration import is_calibration
from spikeport.experiments.options import REPLAY, WITHOUT_NEURONS, Experiment, Options

CALIBRATED = "calibrated"


def run(request: CalibrateRequest) -> None:
    """Refit the decoders of an experiment's network, and write them to a file."""
    experiment, target = registry.get(request.experiment), request.target
    _check(request, experiment)
    settings = experiment.parse_settings(request.settings)
    if settings.get(CALIBRATED, True) is not True:
        raise UsageError(
            f"--set {CALIBRATED}={str(settings[CALIBRATED]).lower()}: the command finds a "
            "calibration of its own; leave it out"
        )
    _refuse_perturbations(settings)
    _refuse_settings_of_runs(settings, experiment)
    chosen = experiment.settings(**settings)
    with progress_bar() as progress, cut_off_by_design():
        options = Options(
            seconds=seconds_of(request.seconds, experiment),
            backend=target.backend,
            chip=target.chip,
            pipeline=experiment.passes(target.passes),
            progress=progress,
        )
        trial = experiment.trial(chosen, options)
        check_needed(settings, [trial])
        trial.check()
        calibration = trial.calibrate()
    calibration.save(request.out)
    numbers = sum(D.size for D in calibration.decoders.values())
    image = calibration.image_digest[:16]
    where = f"on image {image}" if image else f"on backend {target.backend}"
    console = line_console()
    console.print(f"{numbers:,} decoders refitted {where}")
    console.print(f"written: {request.out}")


def _refuse_perturbations(settings: Mapping[str, object]) -> None:
    """Refuse settings that perturb the robot of a run, which no calibration depends on."""
    from spikeport.robot.perturbation import Perturbation  # needs mujoco

    for name in sorted({field.name for field in fields(Perturbation)} & settings.keys()):
        raise UsageError(
            f"--set {name}: calibrations are made without perturbations, except for those of a "
            "gait; cure: leave it out, or for a robot that is pushed give --set gait=rough"
        )


def _refuse_settings_of_runs(settings: Iterable[str], experiment: Experiment) -> None:
    for name in sorted(set(experiment.of_run) & set(settings)):
        raise UsageError(
            f"--set {name}: changes a run, and not the decoders that are calibrated; cure: leave "
            "it out here, and give it to `run`"
        )


def _check(request: CalibrateRequest, experiment: Experiment) -> None:
    backends = [name for name in experiment.backends if name not in (WITHOUT_NEURONS, REPLAY)]
    backend = request.target.backend
    if backend not in backends:
        raise unknown(f"backend with neurons of {experiment.name}", backend, backends)
    check_output("--out", request.out)
    if os.path.exists(request.out) and not is_calibration(request.out):
        raise UsageError(f"--out {request.out}: exists, and is not a calibration; choose another")
    check_target(request.target)
