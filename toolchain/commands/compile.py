"""``spikeport compile``."""

from pathlib import Path

from rich.console import Console

from spikeport.commands.progress import progress_bar
from spikeport.commands.tables import core_table, resource_table
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.experiments.run_folder import write_json
from spikeport.find_network import find_network


def run(spec: str, chip: str, pairs: list[str], out: Path | None, json: Path | None) -> None:
    """Compile, print the report, and write what was asked for."""
    with progress_bar() as progress:
        progress("building the network", None)
        network = find_network(spec, pairs)
        progress("compiling", None)
        compilation = compile_network(network, chip)
    show(compilation)
    report = compilation.report.to_dict()
    if out is not None:
        compilation.image.save(out / "image.npz")
        write_json(out / "report.json", report)
    if json is not None:
        write_json(json, report)


def show(compilation: Compilation) -> None:
    """Print the report."""
    console = Console()
    report = compilation.report
    console.print(resource_table(report))
    console.print(core_table(report))
    for warning in report.warnings:
        console.print(f"[dim]nengo-loihi: {warning}[/dim]")
    console.print(f"fits chip '{report.chip.name}'; image {report.digest[:16]}")
