"""The tables the commands print."""

from collections.abc import Iterator

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from spikeport.compile.image.expected import Rates
from spikeport.compile.report.loss import Loss
from spikeport.compile.report.report import Report
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import EnergyCalibration
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import Draw, EnergyReport, energy
from spikeport.hardware_models.limits import Usage
from spikeport.hardware_models.timing import timing
from spikeport.hardware_models.topology import chips_used

NO_FIGURE = "no public figure"
OF_BOARD = ("cores", "chips")
MOST_PARTS = 6
MOST_EVENTS = 3
BITS_PER_KIB = 8 * 1024


def resource_table(report: Report) -> Table:
    """Every resource: the chip's sum, and the core that uses most of it."""
    title = escape(f"{report.chip.title}: {cores_in_words(report)}")
    table = Table(box=SIMPLE_HEAD, title=title, pad_edge=False, collapse_padding=True)
    table.add_column("used / limit", no_wrap=True)
    whole = "whole chip" if report.chip.limits.chips.count == 1 else "whole board"
    for name in (whole, "%", "fullest", "%", "core"):
        table.add_column(name, justify="right", no_wrap=True)
    fullest, labels = report.fullest(), [core.label for core in report.cores]
    for name, total in report.resources().items():
        if name == "chips" and total.limit == 1:
            continue
        core = () if name in OF_BOARD else _on_fullest(fullest[name], labels)
        table.add_row(name.replace("_", " "), *_share(total), *core)
    return table


def _on_fullest(one: Usage, labels: list[str]) -> tuple[str, ...]:
    return *_share(one), str(labels.index(one.object))


def cores_in_words(report: Report) -> str:
    """How many cores, and chips where it takes several, in words."""
    cores = f"{len(report.cores)} core{'s' * (len(report.cores) != 1)}"
    chips = chips_used(len(report.cores), report.chip)
    return cores if chips == 1 else f"{cores} of {chips} chips"


def _share(usage: Usage) -> tuple[str, str]:
    scale, unit = (BITS_PER_KIB, " KiB") if usage.unit == "bit" else (1, "")
    if usage.limit is None:
        return f"{usage.used / scale:,.0f}{unit} / not public", ""
    amounts = f"{usage.used / scale:,.0f} / {usage.limit / scale:,.0f}{unit}"
    return amounts, f"{100 * usage.used / usage.limit:.1f}"


def cost_table(chip: ChipModel, activity: Activity, rates: Rates | None = None) -> Table:
    """Energy and time of a run, or expected at stated rates, in every calibration of the chip."""
    table = Table("", box=SIMPLE_HEAD, title=f"energy and time, {_basis(activity, rates)}")
    rows: dict[str, list[str]] = {}
    for calibration in chip.calibrations:
        table.add_column(escape(calibration.name))
        for label, text in _cost_rows(chip, activity, calibration):
            rows.setdefault(label, []).append(text)
    for label, texts in rows.items():
        table.add_row(label, *(escape(text) for text in texts))
    return table


def _basis(activity: Activity, rates: Rates | None) -> str:
    if rates is None:
        return f"from the counts of {activity.n_steps:,} steps"
    named = [f"{name} {rate:g} Hz" for name, rate in rates.by_name_hz.items()]
    return escape(f"expected at {', '.join([f'{rates.all_hz:g} Hz', *named])}")


def _cost_rows(
    chip: ChipModel, activity: Activity, calibration: EnergyCalibration
) -> Iterator[tuple[str, str]]:
    spent = energy(activity, chip, calibration)
    draws: list[tuple[str, Draw | None]]
    draws = [("dynamic", spent.dynamic), ("static", spent.static), ("system", spent.system)]
    yield (
        "dynamic energy / step",
        (spent.dynamic.energy_step.format() if spent.dynamic else NO_FIGURE),
    )
    yield "of it", _where_it_goes(spent)
    for name, draw in draws:
        yield f"{name} power", draw.power.format() if draw else NO_FIGURE
    if not calibration.has_times:
        yield from ((label, NO_FIGURE) for label in ("step time, mean", "step time, longest"))
        return
    taken = timing(activity, chip, calibration)
    fits = "within" if taken.fits else "longer than"
    yield "step time, mean", taken.mean.format()
    longest = f"{taken.worst.format()}, {fits} dt = {1000 * taken.dt_s:g} ms"
    yield "step time, longest", f"{longest} (core {activity.cores.index(taken.limiting_core)})"
    if chips_used(len(activity.cores), chip) > 1:
        time = taken.between_chips.format() if taken.between_chips else NO_FIGURE
        yield "between chips", f"{_between_chips(spent, activity):,.1f} messages / step: {time}"


def _between_chips(spent: EnergyReport, activity: Activity) -> float:
    """Messages of a step that leave their chip."""
    counts = {term.event: term.count for term in spent.terms}
    return counts["message_between_chips"] / activity.n_steps


def _where_it_goes(spent: EnergyReport) -> str:
    """The events that take most of the dynamic energy, with their shares."""
    known = [(t.energy.value, t.event.replace("_", " ")) for t in spent.terms if t.energy]
    whole = sum(value for value, _ in known)
    largest = [row for row in sorted(known, reverse=True)[:MOST_EVENTS] if row[0] > whole / 100]
    return ", ".join(f"{name} {100 * value / whole:.0f} %" for value, name in largest)


def cost_notes(chip: ChipModel, activity: Activity) -> Iterator[str]:
    """Where the figures of a table of costs are from."""
    for calibration in chip.calibrations:
        missing = energy(activity, chip, calibration).missing
        absent = f"; not public: {', '.join(missing)}" if missing else ""
        yield f"{calibration.name}: {calibration.description}{absent}"
    for name, figure in (("static", chip.power.static_chip_w), ("system", chip.power.board_idle_w)):
        if figure is not None:
            yield f"{name}: {figure.estimate.source}" + (f"; {figure.note}" * bool(figure.note))


def loss_table(loss: Loss) -> Table:
    """What rounding cost the outputs, largest share first."""
    title = f"loss: outputs {100 * loss.output_error:.2g} % off, {loss.n_steps:,} steps"
    floor = f"a change in the last bit alone: {100 * loss.floor:.2g} %"
    table = Table("cause", box=SIMPLE_HEAD, title=title, caption=floor)
    for name in ("rounding", "output error", "share"):
        table.add_column(name, justify="right", no_wrap=True)
    for part in loss.parts[:MOST_PARTS]:
        numbers = (part.rounding, part.output_error, part.share)
        table.add_row(escape(f"{part.object}: {part.what}"), *(f"{100 * n:.2g} %" for n in numbers))
    return table
