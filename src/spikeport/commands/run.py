"""``spikeport run``."""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from spikeport import settings
from spikeport.commands.progress import progress_bar
from spikeport.commands.tables import cost_notes, cost_table, resource_table
from spikeport.compile.passes.parse import parse
from spikeport.errors import UsageError, unknown
from spikeport.experiments import registry, run_folder
from spikeport.experiments.options import Experiment, Options, Outcome
from spikeport.hardware_models import chip as chips


@dataclass(frozen=True)
class Request:
    """What the user asked for."""

    experiment: str
    backend: str
    chip: str
    passes: str | None
    seed: int
    seconds: float | None
    settings: list[str]
    out: Path | None
    overwrite: bool
    video: bool


def run(request: Request) -> None:
    """Check the request, run the experiment, print its figures."""
    experiment = registry.get(request.experiment)
    if request.backend not in experiment.backends:
        raise unknown(f"backend of {experiment.name}", request.backend, experiment.backends)
    owner = f"experiment '{experiment.name}'"
    chosen = experiment.settings(**settings.parse(request.settings, experiment.settings, owner))
    seconds = seconds_of(request.seconds, experiment)
    chips.get(request.chip)
    if request.passes is not None:
        parse(request.passes)
    folder = run_folder.create(request.out, experiment.name, request.overwrite)
    with run_folder.removed_if_empty(folder), progress_bar() as progress:
        options = Options(
            seconds=seconds,
            backend=request.backend,
            chip=request.chip,
            pipeline=experiment.passes(request.passes),
            seed=request.seed,
            video=request.video,
            progress=progress,
            command=("spikeport", *sys.argv[1:]),
        )
        outcome = experiment.run(chosen, options, folder)
    show(outcome, folder)


def seconds_of(asked: float | None, experiment: Experiment) -> float:
    """The time to simulate; UsageError if it is too short, or no time at all."""
    seconds = experiment.seconds if asked is None else asked
    if not (math.isfinite(seconds) and seconds >= experiment.shortest_s):
        least = f"{experiment.name} simulates at least {experiment.shortest_s:g} s"
        raise UsageError(f"--seconds {seconds:g}: {least}")
    return seconds


def show(outcome: Outcome, folder: Path) -> None:
    """Print what came out of a run."""
    console = Console()
    result = outcome.result
    if outcome.report is not None:
        console.print(resource_table(outcome.report))
        console.print(cost_table(outcome.report.chip, outcome.activity))
        for note in cost_notes(outcome.report.chip, outcome.activity):
            console.print(note, style="dim", markup=False)
    table = Table(
        "metric", "value", box=SIMPLE_HEAD, title=f"{result['experiment']} on {result['backend']}"
    )
    for name, value in result["metrics"].items():
        table.add_row(name, _text(value))
    console.print(table)
    names = ", ".join(sorted(p.name for p in folder.iterdir()))
    console.print(f"written: {folder}/ ({names})", markup=False)


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        called = f"{value['name']}: " if "name" in value else ""
        return called + ", ".join(f"{k} {_text(v)}" for k, v in value.items() if k != "name")
    if isinstance(value, list):
        rows = any(isinstance(v, dict) for v in value)
        return ("\n" if rows else "  ").join(_text(v) for v in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)
