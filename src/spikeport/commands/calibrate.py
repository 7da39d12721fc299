"""``spikeport calibrate``."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from spikeport import settings
from spikeport.commands.progress import progress_bar
from spikeport.commands.run import seconds_of
from spikeport.compile.passes.parse import parse
from spikeport.errors import UsageError, unknown
from spikeport.experiments import registry
from spikeport.experiments.options import Experiment, Options
from spikeport.hardware_models import chip as chips

WITHOUT_NEURONS = "analytic"


@dataclass(frozen=True)
class Request:
    """What the user asked for."""

    experiment: str
    backend: str
    chip: str
    passes: str | None
    seconds: float | None
    settings: list[str]
    out: Path


def run(request: Request) -> None:
    """Refit the decoders of an experiment's network, and write them to a file."""
    experiment = registry.get(request.experiment)
    _check(request, experiment)
    owner = f"experiment '{experiment.name}'"
    chosen = experiment.settings(**settings.parse(request.settings, experiment.settings, owner))
    with progress_bar() as progress:
        options = Options(
            seconds=seconds_of(request.seconds, experiment),
            backend=request.backend,
            chip=request.chip,
            pipeline=experiment.passes(request.passes),
            progress=progress,
        )
        calibration = experiment.trial(chosen, options).calibrate()
    calibration.save(request.out)
    numbers = sum(D.size for D in calibration.decoders.values())
    image = calibration.image_digest[:16]
    where = f"on image {image}" if image else f"on backend {request.backend}"
    console = Console(soft_wrap=True, highlight=False)
    console.print(f"{numbers:,} decoders refitted {where}", markup=False)
    console.print(f"written: {request.out}", markup=False)


def _check(request: Request, experiment: Experiment) -> None:
    backends = [name for name in experiment.backends if name != WITHOUT_NEURONS]
    if request.backend not in backends:
        raise unknown(f"backend with neurons of {experiment.name}", request.backend, backends)
    if request.out.is_dir():
        raise UsageError(f"--out {request.out}: this is a folder; give the file to write, *.npz")
    chips.get(request.chip)
    if request.passes is not None:
        parse(request.passes)
