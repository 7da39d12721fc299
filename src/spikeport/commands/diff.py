"""``spikeport diff A B``: the changes from one compile, run or evaluation to another."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from spikeport.atomic import check_output
from spikeport.commands.console import Console, ScreenTable
from spikeport.commands.report_file import check_whole, read, report_file, run_of
from spikeport.compile.report.report import Json
from spikeport.counted import counted
from spikeport.errors import UsageError, printable
from spikeport.experiments.evaluate.comparison import compare, is_evaluation
from spikeport.experiments.evaluate.interval import CONFIDENCE

SAME, DIFFERENT = 0, 1

RUN = "run"
"""The section of a run, which is in its ``result.json``."""
SECTIONS = ("chip", RUN, "passes", "quantisation", "basis", "energy", "timing", "host_io", "loss")

Figures = dict[str, object]
"""Numbers, texts and unknown values (None), by name."""

Rows = Sequence[Sequence[str]]
"""Differences in words: the figure, both values, and the change."""

CONDITIONS = {
    "experiment": "experiment",
    "model": "model",
    "backend": "backend",
    "seconds": "seconds",
    "seeds": "seed of the",
    "settings": "setting",
    "files": "digest of",
    "versions": "version of",
    "metrics": "",
}
"""The parts of a run's result that are compared, and what the names of figures begin with."""
OF_THE_CLOCK = "real_time_factor"
"""The metric that no run repeats."""


class Change(NamedTuple):
    """A figure that differs between two reports; None if a report does not have it."""

    figure: str
    a: object
    b: object


def run(a: Path, b: Path, html: Path | None = None) -> int:
    """Print differences, and write them as a page; like ``diff``, return 1 if any, else 0."""
    file_a, file_b = report_file(a), report_file(b)
    kinds = {is_evaluation(file_a), is_evaluation(file_b)}
    if kinds == {True, False}:
        raise UsageError(f"{a} and {b}: an evaluation and a report have no figures in common")
    if kinds == {True}:
        rows, note = _compare_evaluations(file_a, file_b, html)
    else:
        rows, note = _compare_reports(a, b, html)
    console = Console(highlight=False)
    if rows:
        table = ScreenTable("figure")
        table.add_numbers(str(a), str(b), "change")
        for row in rows:
            table.add_row(*row)
        console.print(table)
    else:
        console.print("no difference")
    if note:
        console.print(note, soft_wrap=True)
    return DIFFERENT if rows else SAME


def _compare_evaluations(a: Path, b: Path, html: Path | None) -> tuple[Rows, str]:
    """Return the figures that differ by more than chance, and the number that were compared."""
    if html is not None:
        raise UsageError("--html: an evaluation has no page; cure: leave it out")
    differences, compared = compare(a, b)
    by_chance = compared * (1 - CONFIDENCE)
    note = (
        f"figures compared, by Fisher's test and intervals of 95 %: {compared}; between two "
        f"evaluations of one policy, at most about {by_chance:.0f} would differ"
    )
    return [tuple(map(printable, one)) for one in differences], note


def _compare_reports(a: Path, b: Path, html: Path | None) -> tuple[Rows, str]:
    """Return the figures that differ, and a note on sections that one of the reports lacks."""
    if html is not None:
        check_output("--html", html, *map(report_file, (a, b)), suffix=".html")
    reports = {str(path): read(path) for path in (a, b)}
    compared = [reports[str(path)] | {RUN: run_of(path, reports[str(path)])} for path in (a, b)]
    rows = [_texts(change) for change in changes(*compared)]
    if html is not None:
        for name, report in reports.items():
            check_whole(name, report)
        from spikeport.compile.report.page import write_pair  # imports jinja2

        write_pair(html, reports, rows)
        print(f"written: {html}")
    alone = [one for one in SECTIONS if sum(one in _held(each) for each in compared) == 1]
    lacking = f"not compared, since one report lacks them: {', '.join(alone)}"
    return rows, lacking if alone else ""


def changes(a: Json, b: Json) -> list[Change]:
    """Return the figures that differ, or are in one report only, in sections that both have."""
    shared = [section for section in SECTIONS if section in _held(a) & _held(b)]
    left, right = figures(a, shared), figures(b, shared)
    names = [*left, *(name for name in right if name not in left)]
    pairs = [Change(name, left.get(name), right.get(name)) for name in names]
    return [change for change in pairs if change.a != change.b]


def _held(report: Json) -> set[str]:
    """Return the sections that a report has: one may be empty, but a refused network has none."""
    if not report["image_digest"]:  # no image was made
        return {"chip"} & report.keys()
    return {section for section in SECTIONS if report.get(section) is not None}


def figures(report: Json, sections: Sequence[str] = SECTIONS) -> Figures:
    """Return the figures of a report that are compared, by name."""
    found: Figures = {"image": report["image_digest"][:16]}
    for name, row in report["resources"].items():
        found |= {f"{name} {key}": value for key, value in row.items()}
    # A network that is refused takes no resources: why it is refused is all that differs.
    for one in report.get("violations", ()):
        rule = f"{one['id']} {one['rule']}".strip()  # a builder's own refusal has no id
        name = f"{one['object']}: {rule}"
        # A rule may be broken by an object twice, such as by two settings.
        found[name] = f"{found[name]}; {one['used']}" if name in found else one["used"]
    for section in sections:
        found |= FIGURES[section](report[section])
    return found


def _run(result: Json) -> Figures:
    """Return the conditions of a run, and its metrics except the one that depends on the clock."""
    parts = [(name, result[part]) for part, name in CONDITIONS.items() if result.get(part)]
    found = (one for name, value in parts for one in _flat(name, value))
    figures = {name.strip(): value for name, value in found}
    figures.pop(OF_THE_CLOCK, None)
    return figures


def _flat(name: str, value: object) -> Iterator[tuple[str, object]]:
    """Yield the numbers and texts in plain data, with their names."""
    match value:
        case dict():
            for key, one in value.items():
                yield from _flat(f"{name} {key}", one)
        case list() if all(isinstance(one, str) for one in value):
            yield name, ", ".join(value)
        case list():
            for number, one in enumerate(value):
                yield from _flat(f"{name}[{number}]", one)
        case _:
            yield name, value


def _passes(passes: list[Json]) -> Figures:
    return {"passes": ",".join(map(_pass, passes)) or "none"}


def _pass(record: Json) -> str:
    options = ",".join(f"{key}={value}" for key, value in record["options"].items())
    return f"{record['name']}" + f"{{{options}}}" * bool(options)


def _rounding(errors: list[Json]) -> Figures:
    return {f"rounding of weights, {error['label']}": error["weights"] for error in errors}


def _basis(basis: Json) -> Figures:
    rates = [f"{name} {hz:g} Hz" for name, hz in (basis["rates_hz"] or {}).items()]
    run = f"a run of {counted(basis['n_steps'], 'step')}"
    return {"counts of events": f"expected at {', '.join(rates)}" if rates else run}


def _powers(energy: Json) -> Figures:
    return {
        f"{part} power, {calibration} (W)": spent[part] and spent[part]["power"]["value"]
        for calibration, spent in energy.items()
        for part in ("dynamic", "static", "system")
    }


def _times(timing: Json) -> Figures:
    return {
        f"longest step, {calibration} (s)": taken and taken["worst"]["value"]
        for calibration, taken in timing.items()
    }


def _host_io(host_io: Json) -> Figures:
    return {
        "host spikes / step": host_io["spikes"],
        "most host spikes in a step": host_io["most_spikes"],
        "words back / step": host_io["words_back"],
        "host I/O": host_io["verdict"],
    }


def _loss(loss: Json) -> Figures:
    parts = {f"loss by {p['object']}: {p['what']}": p["output_error"] for p in loss["parts"]}
    errors = {
        "loss at the outputs": loss["output_error"],
        "loss at the probes, against float Nengo": loss["network_error"],
    }
    return errors | parts


FIGURES: dict[str, Callable[[Any], Figures]] = {
    "chip": lambda name: {"chip": name},
    RUN: _run,
    "passes": _passes,
    "quantisation": _rounding,
    "basis": _basis,
    "energy": _powers,
    "timing": _times,
    "host_io": _host_io,
    "loss": _loss,
}


def _texts(change: Change) -> list[str]:
    """Return a change in words: the figure, both values, and the relative growth."""
    texts = (change.figure, _text(change.a), _text(change.b), _relative(change))
    return [printable(text) for text in texts]


def _text(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:,.4g}" if isinstance(value, float) else str(value)


def _relative(change: Change) -> str:
    """Return the growth of a number, in percent."""
    figure, a, b = change
    if isinstance(a, bool) or isinstance(b, bool) or figure.startswith(("seed ", "setting ")):
        return ""
    if not (isinstance(a, int | float) and isinstance(b, int | float)) or a == 0:
        return ""
    return f"{100 * (b - a) / a:+.1f} %"
