"""``spikeport chips`` and ``spikeport backends``."""

from rich.console import Console
from rich.table import Table

from spikeport.backends.registry import BACKENDS
from spikeport.experiments.registry import EXPERIMENTS
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import Chip


def print_chips() -> None:
    """Every built-in chip with its limits, power and calibrations."""
    console = Console()
    for name in chips.names():
        console.print(_chip_table(chips.get(name)))
    console.print("any other chip: --chip path/to/chip.toml")


def _chip_table(chip: Chip) -> Table:
    table = Table("figure", "value", "evidence", "source", title=f"{chip.name}: {chip.title}")
    for group in (chip.limits, chip.power):
        for name in type(group).model_fields:
            figure = getattr(group, name)
            if figure is not None:
                table.add_row(
                    name.replace("_", " "),
                    f"{figure.value:,g} {figure.unit}".removesuffix(" 1"),
                    figure.evidence,
                    figure.source,
                )
    for calibration in chip.calibrations:
        table.add_row("calibration", calibration.name, "", calibration.description)
    return table


def print_backends() -> None:
    """Every backend; ``analytic`` is not one, but experiments take it in the place of one."""
    table = Table("backend", "what it is", "experiments")
    for name, backend in BACKENDS.items():
        table.add_row(name, backend.summary, _experiments(name))
    table.add_row("analytic", "no neurons: the exact control law", _experiments("analytic"))
    Console().print(table)


def _experiments(backend: str) -> str:
    return ", ".join(e.name for e in EXPERIMENTS.values() if backend in e.backends)
