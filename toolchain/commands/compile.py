"""``spikeport compile``."""

from pathlib import Path

from rich.console import Console

from spikeport.commands.progress import progress_bar
from spikeport.commands.tables import core_table, resource_table
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.errors import UsageError
from spikeport.experiments.run_folder import write_json
from spikeport.find_network import find_network
from spikeport.hardware_models import chip as chips


def run(spec: str, chip: str, pairs: list[str], out: Path | None, json: Path | None) -> None:
    """Compile, write what was asked for, and print the report."""
    _check_places(out, json)
    chips.get(chip)
    with progress_bar() as progress:
        progress("building the network", None)
        network = find_network(spec, pairs)
        progress("compiling", None)
        compilation = compile_network(network, chip)
    report = compilation.report.to_dict()
    if out is not None:
        compilation.image.save(out / "image.npz")
        write_json(out / "report.json", report)
    if json is not None:
        write_json(json, report)
    show(compilation)


def _check_places(out: Path | None, json: Path | None) -> None:
    """Say what cannot be written before the work, not after it."""
    if out is not None and out.exists() and not out.is_dir():
        raise UsageError(f"--out {out}: is a file; choose a folder")
    if json is not None and json.exists() and not json.is_file():
        raise UsageError(f"--json {json}: is not a file that can be replaced; choose another")


def show(compilation: Compilation) -> None:
    """Print the report."""
    console = Console()
    report = compilation.report
    console.print(resource_table(report))
    console.print(core_table(report))
    for warning in report.warnings:
        console.print(f"nengo-loihi: {warning}", style="dim", markup=False)
    console.print(f"fits chip '{report.chip.name}'; image {report.digest[:16]}", markup=False)
