"""``spikeport chips`` and ``spikeport backends``."""

from collections.abc import Iterator

from pydantic import BaseModel
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from spikeport.backends.registry import BACKENDS
from spikeport.experiments.registry import EXPERIMENTS
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.figure import Figure


def print_chips() -> None:
    """Every built-in chip with its limits, power and calibrations."""
    console = Console()
    for name in chips.names():
        console.print(_chip_table(chips.get(name)))
    console.print("any other chip: --chip path/to/chip.toml")


def _chip_table(chip: Chip) -> Table:
    columns = ("figure", "value", "evidence", "source")
    table = Table(*columns, box=SIMPLE_HEAD, title=f"{chip.name}: {chip.title}")
    for what, figure in _figures(chip):
        value = f"{figure.count:,}" if figure.unit in ("1", "bit") else figure.estimate.format()
        table.add_row(what, escape(value), figure.evidence, figure.source)
    return table


def _figures(chip: Chip) -> Iterator[tuple[str, Figure]]:
    """Every figure of a chip that is known, with what it is a figure of."""
    groups: list[tuple[str, BaseModel]] = [("", chip.limits), ("", chip.power)]
    for calibration in chip.calibrations:
        groups += [
            (f"{calibration.name}: energy of ", calibration.energies),
            (f"{calibration.name}: time of ", calibration.times),
        ]
    for prefix, group in groups:
        for name in type(group).model_fields:
            if (figure := getattr(group, name)) is not None:
                yield prefix + name.replace("_", " "), figure


def print_backends() -> None:
    """Every backend; ``analytic`` is not one, but experiments take it in the place of one."""
    table = Table("backend", "what it is", "experiments", box=SIMPLE_HEAD)
    for name, backend in BACKENDS.items():
        table.add_row(name, backend.summary, _experiments(name))
    table.add_row("analytic", "no neurons: the exact control law", _experiments("analytic"))
    Console().print(table)


def _experiments(backend: str) -> str:
    return ", ".join(e.name for e in EXPERIMENTS.values() if backend in e.backends)
