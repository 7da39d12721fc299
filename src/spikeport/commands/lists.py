"""``spikeport chips`` and ``spikeport backends``."""

from collections.abc import Iterator

from pydantic import BaseModel

from spikeport.backends.registry import BACKENDS
from spikeport.commands.console import Console, ScreenTable
from spikeport.counted import counted
from spikeport.errors import MissingExtraError
from spikeport.experiments import registry
from spikeport.experiments.options import WITHOUT_NEURONS, Experiment
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.figure import Figure


def print_chips() -> None:
    """Print all built-in chips with their limits, power and calibrations."""
    console = Console()
    for name in chips.names():
        console.print(_chip_table(chips.get(name)))
    console.print("any other chip: --chip path/to/chip.toml")


def _chip_table(chip: ChipModel) -> ScreenTable:
    title = f"{chip.name}: {chip.title}"
    table = ScreenTable("figure", "value", "evidence", "source", title=title, caption=chip.caveat)
    for what, figure in _figures(chip):
        value = f"{figure.count:,}" if figure.unit in ("1", "bit") else figure.estimate.format()
        source = figure.source + f"; {figure.note}" * bool(figure.note)
        table.add_row(what, value, figure.evidence, source)
    table.add_row("not public", ", ".join(_absent(chip)))
    return table


def _absent(chip: ChipModel) -> Iterator[str]:
    """Yield the names of limits, powers and parts of a chip without a public figure."""
    for group in (chip.limits, chip.power, chip):
        for name in type(group).model_fields:
            if getattr(group, name) is None:
                yield name.removesuffix("_w").replace("_", " ")
    for calibration in chip.calibrations:
        for what, events in (("energy", calibration.energies), ("time", calibration.times)):
            missing = [name.replace("_", " ") for name, figure in events if figure is None]
            if missing:
                yield f"{what} of {', '.join(missing)} ({calibration.name})"


def _figures(chip: ChipModel) -> Iterator[tuple[str, Figure]]:
    """Yield every known figure of a chip, after its name."""
    groups: list[tuple[str, BaseModel]] = [("", chip.limits), ("", chip.power)]
    parts = {
        "synapse memory: ": chip.synapse_memory,
        "mesh: ": chip.topology,
        "host I/O: ": chip.host_io,
        "shared memory: ": chip.soft_memory,
    }
    groups += [(prefix, part) for prefix, part in parts.items() if part is not None]
    for calibration in chip.calibrations:
        groups += [
            (f"{calibration.name}: energy of ", calibration.energies),
            (f"{calibration.name}: time of ", calibration.times),
        ]
    if chip.clock is not None:
        yield "clock", chip.clock
    for prefix, group in groups:
        for name in type(group).model_fields:
            if (figure := getattr(group, name)) is not None:
                yield prefix + name.removesuffix("_w").replace("_", " "), figure
    for calibration in chip.calibrations:
        for point in calibration.barrier:
            yield f"{calibration.name}: time of barrier, {counted(point.tiles, 'tile')}", point


def print_backends() -> None:
    """Print all backends, and ``analytic``, which experiments take in place of a backend."""
    console = Console()
    experiments, absent = _experiments()
    summaries = {name: backend.summary for name, backend in BACKENDS.items()}
    summaries[WITHOUT_NEURONS] = "no neurons: the exact control law"
    table = ScreenTable("backend", "what it is", "experiments")
    for name, summary in summaries.items():
        table.add_row(name, summary, ", ".join(e.name for e in experiments if name in e.backends))
    console.print(table)
    if absent:
        names, reason = ", ".join(absent), next(iter(absent.values()))
        console.print(f"experiments that are not available: {names}; {reason}")


def _experiments() -> tuple[list[Experiment], dict[str, MissingExtraError]]:
    """Return the experiments whose packages are installed, and the errors of the others."""
    found, absent = [], {}
    for name in registry.EXPERIMENTS:
        try:
            found.append(registry.get(name))
        except MissingExtraError as error:
            absent[name] = error
    return found, absent
