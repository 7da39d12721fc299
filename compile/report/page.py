"""A report as a page: one HTML file without requests, and without fonts or scripts of others.

The page works without a mouse and without scripts, dark, light and on paper; its one script sorts
tables. ``page.html.jinja`` has the layout, `View` the content.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache, cached_property
from math import log1p
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from spikeport.atomic import write_text
from spikeport.compile.image.expected import AT_STATED_RATES
from spikeport.compile.report.drawing import SIDE, Chip, chips, estimate
from spikeport.compile.report.report import Json
from spikeport.counted import counted, in_kib, percent
from spikeport.hardware_models.estimate import merge_sources
from spikeport.hardware_models.host_io import HostIoReport

MOST_CELLS = 4000
"""The most cells in the drawing of messages; the report as data has all of them."""
MOST_ROWS = 12
"""The rows of a table of the largest items."""


class Bar(NamedTuple):
    """A resource in words: use, limit and fullest core, with shares of the limits."""

    name: str
    used: str
    limit: str
    share: float | None
    fullest: str
    fullest_share: float | None
    core: int | None


class Cell(NamedTuple):
    """Messages from one core to another in a step, and the darkness that they are drawn in."""

    source: int
    target: int
    messages: float
    share: float


class Row(NamedTuple):
    """A name, a figure in words, and its share of the largest."""

    name: str
    text: str
    share: float


class Rule(NamedTuple):
    """Hints or violations of one rule, with their common cure; empty if cures differ by row."""

    id: str
    rule: str
    cure: str
    rows: tuple[Json, ...]


def write_page(path: Path, report: Json, title: str) -> None:
    """Write a report as a page, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    report : dict
        The report as plain data, see `spikeport.compile.report.report.Report.to_dict`.
    title : str
        The name of the compiled network.
    """
    write_text(path, _template().render(title=title, views=[View(report, title)], changes=None))


def write_pair(path: Path, reports: Mapping[str, Json], changes: Sequence[Sequence[str]]) -> None:
    """Write two reports as one page, one beside the other, whole or not at all.

    Parameters
    ----------
    path : Path
        The file.
    reports : mapping of str to dict
        The reports as plain data, by name.
    changes : sequence of sequences of str
        Every figure that differs: its name, its value in each report, and by how much it grew.
    """
    views = [View(report, name) for name, report in reports.items()]
    title = " and ".join(reports)
    write_text(path, _template().render(title=title, views=views, changes=changes))


@cache
def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        # Labels are text, whatever letters a user's network has in them.
        autoescape=True,
        # A key that the report lacks is an error, not a gap on the page.
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["estimate"] = estimate
    environment.filters.update(count=_count, counted=counted, in_percent=percent)
    environment.globals.update(core_side=SIDE, at_stated_rates=AT_STATED_RATES, most_rows=MOST_ROWS)
    environment.filters["words"] = lambda name: name.replace("_", " ")
    return environment.get_template("page.html.jinja")


class View:
    """The content of a page on a report.

    Parameters
    ----------
    report : dict
        The report as plain data.
    title : str
        The name of the compiled network.

    Attributes
    ----------
    calibration : str
        The calibration whose costs the page draws: the first with times, or else the first.
    """

    def __init__(self, report: Json, title: str) -> None:
        self.report, self.title = report, title
        timing: Mapping[str, object] = report["timing"] or {}
        # The first that has times, so that all measures of the map are of one source.
        self.calibration = next(
            (name for name, taken in timing.items() if taken), next(iter(timing), "")
        )

    @cached_property
    def bars(self) -> list[Bar]:
        """The use of every resource."""
        rows = self.report["resources"].items()
        # If there is only one chip, its use needs no row.
        one_chip = self.report["resources"]["chips"]["limit"] == 1
        return [self._bar(name, row) for name, row in rows if not (one_chip and name == "chips")]

    def _bar(self, name: str, row: Json) -> Bar:
        words, share = name.replace("_", " "), _share(row["used"], row["limit"])
        used, limit = _amount(name, row["used"]), _amount(name, row["limit"])
        limits, cores = self.report["limits_of_a_core"], self.report["cores"]
        if name not in limits or not cores:
            return Bar(words, used, limit, share, "", None, None)
        # The first core, if several are equally full.
        core = max(range(len(cores)), key=lambda number: cores[number][name])
        most, of_core = cores[core][name], limits[name]
        text = f"{_amount(name, most)} of {_amount(name, of_core)}"
        return Bar(words, used, limit, share, text, _share(most, of_core), core)

    @cached_property
    def chips(self) -> list[Chip]:
        """The drawings of the chips in use."""
        return chips(self.report, self.calibration)

    def sources(self, calibration: str) -> str:
        """Return the sources of all energies, powers and times in a calibration."""
        spent, taken = (self.report[costs][calibration] for costs in ("energy", "timing"))
        powers = [spent[draw] and spent[draw]["power"] for draw in ("static", "system")]
        figures = filter(None, [spent["dynamic_run"], *powers, taken and taken["mean"]])
        return merge_sources(figure["source"] for figure in figures) or "none is public"

    @cached_property
    def host_io(self) -> list[tuple[str, str]]:
        """The host's input and output, in words; none without an image."""
        found = self.report["host_io"]
        return [] if found is None else list(HostIoReport.of(found).rows())

    @cached_property
    def modules(self) -> list[Row]:
        """The energy of a step by module, the largest first."""
        rows = (self.report["modules"] or {}).get(self.calibration, [])
        return _largest(
            (row["module"], estimate(row["energy_step"]), _value(row["energy_step"]))
            for row in rows
        )

    @cached_property
    def roundings(self) -> list[Row]:
        """The rounding errors of weights by block, the largest first."""
        return _largest(
            (row["label"], percent(row["weights"]), row["weights"])
            for row in self.report["quantisation"]
        )

    @cached_property
    def losses(self) -> list[Row]:
        """The causes of the outputs' error, the largest first; none without a run."""
        return _largest(
            (
                f"{part['object']}: {part['what']}",
                percent(part["output_error"]),
                part["share"],
            )
            for part in (self.report["loss"] or {}).get("parts", ())
        )

    @cached_property
    def cells(self) -> list[Cell]:
        """The messages between cores; none if there are too many to be drawn."""
        found = self._messages()
        # By logarithm, since messages range over orders of magnitude.
        most = log1p(max((messages for *_, messages in found), default=0.0))
        if len(found) > MOST_CELLS or not most:
            return []
        return [Cell(i, j, messages, log1p(messages) / most) for i, j, messages in found]

    @cached_property
    def busiest(self) -> list[Cell]:
        """The pairs of cores with most messages."""
        found = sorted(self._messages(), key=lambda row: -row[-1])
        return [Cell(*row, 0.0) for row in found[:MOST_ROWS]]

    def _messages(self) -> list[tuple[int, int, float]]:
        found: list[tuple[int, int, float]] = (self.report["traffic"] or {}).get(
            "between_cores", []
        )
        return found

    @cached_property
    def hints(self) -> list[Rule]:
        """The hints, rule by rule."""
        return by_rule(self.report["hints"])

    @cached_property
    def violations(self) -> list[Rule]:
        """The reasons why the network does not fit, rule by rule."""
        return by_rule(self.report["violations"])

    @cached_property
    def over_budget(self) -> list[Rule]:
        """The budgets of the user that the network exceeds."""
        return by_rule(self.report.get("over_budget", []))


def by_rule(rows: Iterable[Json]) -> list[Rule]:
    """Return hints or violations, rule by rule in the order of ids."""
    found: dict[tuple[str, str], list[Json]] = {}
    for row in rows:
        found.setdefault((row["id"], row["rule"]), []).append(row)
    return [Rule(*names, _cure(mine), tuple(mine)) for names, mine in sorted(found.items())]


def _cure(rows: Sequence[Json]) -> str:
    """Return the cure that all rows have; an empty text if there are several cures."""
    cures: set[str] = {row["cure"] for row in rows}
    return cures.pop() if len(cures) == 1 else ""


def _share(used: int, limit: int | None) -> float | None:
    return used / limit if limit else None


def _amount(resource: str, number: int | None) -> str:
    if number is None:
        return "not public"
    return f"{in_kib(number)} KiB" if resource.endswith("_bits") else f"{number:,}"


def _count(number: float) -> str:
    """Return a count as text; one that is expected at stated rates may be below 1."""
    return f"{number:,.0f}" if isinstance(number, int) or number >= 100 else f"{number:.3g}"


def _value(estimate: Mapping[str, Any] | None) -> float:
    return 0.0 if estimate is None else estimate["value"]


def _largest(rows: Iterable[tuple[str, str, float]]) -> list[Row]:
    """Return the rows of the largest values above 0, with shares of the largest."""
    found = sorted(rows, key=lambda row: -row[-1])[:MOST_ROWS]
    return [Row(name, text, value / found[0][-1]) for name, text, value in found if value > 0]
