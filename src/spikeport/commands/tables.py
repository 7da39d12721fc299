"""The tables that commands print."""

from collections.abc import Iterator

from spikeport.commands.console import ScreenTable
from spikeport.compile.image.expected import AT_STATED_RATES, Rates
from spikeport.compile.report.loss import Loss
from spikeport.compile.report.report import Report
from spikeport.compile.report.summary import resources
from spikeport.counted import counted, percent
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.calibration import EnergyCalibration
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import NOT_MODELLED as NO_ENERGY
from spikeport.hardware_models.energy import Draw, EnergyReport, energy
from spikeport.hardware_models.host_io import HostIoReport
from spikeport.hardware_models.timing import NOT_MODELLED as NO_TIME
from spikeport.hardware_models.timing import SHARED, TimingReport, timing
from spikeport.hardware_models.topology import chips_used

NO_FIGURE = "no public figure"
MOST_PARTS = 6
MOST_EVENTS = 3


def resource_table(report: Report) -> ScreenTable:
    """Return the table of resources: the chip's sum, and the core that uses most."""
    found = resources(report)
    first, *others = found.header
    table = ScreenTable(first, title=found.title, pad_edge=False, collapse_padding=True)
    table.add_numbers(*others)
    for row in found.rows:
        table.add_row(*row)
    return table


def cost_table(
    chip: ChipModel,
    activity: Activity,
    rates: Rates | None = None,
    host_io: HostIoReport | None = None,
) -> ScreenTable:
    """Return energy and time of a run, or at stated rates, by every calibration of the chip."""
    table = ScreenTable("", title=f"energy and time, {_basis(activity, rates)}")
    columns = []
    for calibration in chip.calibrations:
        table.add_column(calibration.name)
        columns.append(dict(_cost_rows(chip, activity, calibration)))
    # A calibration without times has fewer rows.
    for label in dict.fromkeys(label for column in columns for label in column):
        table.add_row(label, *(column.get(label, NO_FIGURE) for column in columns))
    if host_io is not None and any(c.has_times for c in chip.calibrations):
        table.add_row("with host I/O", *[f"{host_io.dt_in_words} {host_io.verdict}"] * len(columns))
    return table


def host_io_table(host_io: HostIoReport) -> ScreenTable:
    """Return the table of a step's host input and output, and whether dt is known to suffice."""
    table = ScreenTable("", title="host I/O of a step", show_header=False)
    for label, text in host_io.rows():
        table.add_row(label, text)
    return table


def _basis(activity: Activity, rates: Rates | None) -> str:
    if rates is None:
        return f"from the counts of {counted(activity.n_steps, 'step')}"
    named = [f"{name} {rate:g} Hz" for name, rate in rates.by_name_hz.items()]
    return f"expected at {', '.join([f'{rates.others_hz:g} Hz', *named])}"


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
    yield "step time, mean", taken.mean.format()
    yield (
        "step time, longest",
        f"{taken.worst.format()}, {taken.against_dt} ({_slowest(taken, activity)})",
    )
    if chip.clock is not None:
        mean, most = (one.value / chip.clock.value for one in (taken.mean, taken.worst))
        yield "cycles, mean and longest", f"{mean:,.0f} and {most:,.0f}"
    if chips_used(len(activity.cores), chip) > 1:
        time = taken.between_chips.format() if taken.between_chips else NO_FIGURE
        yield "between chips", f"{_between_chips(spent, activity):,.1f} messages / step: {time}"


def _slowest(taken: TimingReport, activity: Activity) -> str:
    """Return the part of the chip that takes longest in the longest step."""
    if taken.limiting_core in SHARED.values():
        return taken.limiting_core
    return f"core {activity.cores.index(taken.limiting_core)}"


def _between_chips(spent: EnergyReport, activity: Activity) -> float:
    """Return the messages of a step that leave their chip."""
    counts = {term.event: term.count for term in spent.terms}
    return counts["message_between_chips"] / activity.n_steps


def _where_it_goes(spent: EnergyReport) -> str:
    """Return the events that take most of the dynamic energy, with their shares."""
    known = [(t.energy.value, t.event.replace("_", " ")) for t in spent.terms if t.energy]
    whole = sum(value for value, _ in known)
    largest = [row for row in sorted(known, reverse=True)[:MOST_EVENTS] if row[0] > whole / 100]
    return ", ".join(f"{name} {100 * value / whole:.0f} %" for value, name in largest)


def cost_notes(chip: ChipModel, activity: Activity, rates: Rates | None = None) -> Iterator[str]:
    """Yield the sources of a table of costs, and what its longest step is at stated rates."""
    if rates is not None and any(c.has_times for c in chip.calibrations):
        yield f"longest step: at stated rates {AT_STATED_RATES}"
    for calibration in chip.calibrations:
        missing = energy(activity, chip, calibration).missing
        untimed = timing(activity, chip, calibration).missing if calibration.has_times else ()
        absent = [f"; not public: {', '.join(missing)}"] if missing else []
        absent += [f"; times not public: {', '.join(untimed)}"] if untimed else []
        yield f"{calibration.name}: {calibration.description}{''.join(absent)}"
    for name, figure in (("static", chip.power.static_chip_w), ("system", chip.power.board_idle_w)):
        if figure is not None:
            yield f"{name}: {figure.estimate.source}" + (f"; {figure.note}" * bool(figure.note))
    yield f"in no total: {'; '.join([*_host_processors(chip), *NO_ENERGY, *NO_TIME])}"


def _host_processors(chip: ChipModel) -> Iterator[str]:
    """Yield the power of a chip's own processors, if there is a figure."""
    figure = chip.power.host_processors_w
    if figure is not None:
        mw, source = 1000 * figure.value, figure.estimate.source
        yield f"host processors on the chip, {mw:g} mW ({source})"


def against_float(loss: Loss) -> str:
    """Return the error of probes against the network as it was written, in words."""
    if loss.network_error is None:
        return (
            "not compared with float Nengo: no value is probed, or sampled in this time, or all "
            "are 0, or input is random"
        )
    error = percent(loss.network_error)
    return f"probes against the network as written, in float Nengo: {error}"


def loss_table(loss: Loss) -> ScreenTable:
    """Return the table of the output errors that rounding causes, largest share first."""
    steps = counted(loss.n_steps, "step")
    title = f"loss to rounding: outputs {percent(loss.output_error)} off, {steps}"
    floor = f"a change in the last bit alone: {percent(loss.floor)}"
    n_parts = len(loss.parts)
    largest = f"the {MOST_PARTS} largest of {n_parts:,} causes; " if n_parts > MOST_PARTS else ""
    caption = f"{largest}{floor}; {against_float(loss)}"
    table = ScreenTable("cause", title=title, caption=caption)
    table.add_numbers("rounding", "output error", "share")
    for part in loss.parts[:MOST_PARTS]:
        numbers = (part.rounding, part.output_error, part.share)
        table.add_row(f"{part.object}: {part.what}", *map(percent, numbers))
    return table
