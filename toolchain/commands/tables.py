"""The tables the commands print."""

from collections.abc import Iterable
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from spikeport.compile.report import Report
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.energy import Draw, energy
from spikeport.hardware_models.limits import Usage
from spikeport.hardware_models.timing import timing

NO_FIGURE = "no public figure"


def resource_table(report: Report) -> Table:
    """Every resource: the chip's sum, and the fullest core."""
    table = Table("used / limit", box=SIMPLE_HEAD)
    for name in ("whole chip", "%", "fullest core", "%"):
        table.add_column(name, justify="right", no_wrap=True)
    fullest = report.fullest()
    for name, total in report.resources().items():
        core = ("", "") if name == "cores" else _share(fullest[name])
        table.add_row(name.replace("_", " "), *_share(total), *core)
    table.title = escape(f"{report.chip.title}: {len(report.cores)} cores")
    return table


def _share(usage: Usage) -> tuple[str, str]:
    return f"{usage.used:,} / {usage.limit:,}", f"{100 * usage.used / usage.limit:.1f}"


def core_table(report: Report) -> Table:
    """Every core: what it holds, and what rounding cost its blocks."""
    title = "cores; rounding error of the weights, and share of them lost to zero"
    table = Table(title=title, box=SIMPLE_HEAD)
    table.add_column("core", no_wrap=True, justify="right")
    table.add_column("holds")
    for name in ("neurons", "axons in", "out", "kbit", "error", "lost"):
        table.add_column(name, justify="right", no_wrap=True)
    errors = {error.label: error for error in report.errors}
    for number, core in enumerate(report.cores):
        error = errors[core.label]
        numbers = (core.compartments, core.in_axons, core.out_axons, core.synapse_bits // 1024)
        shares = (f"{100 * error.weights:.1f} %", f"{100 * error.lost_weights:.0f} %")
        table.add_row(str(number), escape(core.label), *(f"{n:,}" for n in numbers), *shares)
    return table


def cost_table(chip: Chip, activity: Activity) -> Table:
    """Energy and time of a run, in every calibration of the chip."""
    table = Table(
        "", box=SIMPLE_HEAD, title=f"energy and time, from the counts of {activity.n_steps:,} steps"
    )
    rows: dict[str, list[str]] = {}
    for calibration in chip.calibrations:
        table.add_column(escape(calibration.name))
        for label, text in _cost_rows(chip, activity, calibration):
            rows.setdefault(label, []).append(text)
    for label, texts in rows.items():
        table.add_row(label, *(escape(text) for text in texts))
    return table


def _cost_rows(chip: Chip, activity: Activity, calibration: Any) -> Iterable[tuple[str, str]]:
    spent, taken = energy(activity, chip, calibration), timing(activity, chip, calibration)
    for name in ("dynamic", "static", "system"):
        draw: Draw | None = getattr(spent, name)
        yield f"{name} energy / step", draw.energy_step.format() if draw else NO_FIGURE
        yield f"{name} power", draw.power.format() if draw else NO_FIGURE
        if name != "dynamic" and draw is not None:
            yield f"{name} source", draw.power.source.split("; ")[0]
    yield "step time, mean", taken.mean.format()
    yield "step time, worst", f"{taken.worst.format()} ({taken.limiting_core})"
    yield "worst step fits dt", f"{'yes' if taken.fits else 'no'}, dt = {1000 * taken.dt_s:g} ms"
    yield "dynamic and time source", calibration.description
