"""The robustness table: every row's figures with their intervals, as data and as Markdown."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from spikeport.errors import UsageError
from spikeport.experiments.evaluate.interval import Interval, of_mean, of_share
from spikeport.experiments.evaluate.measures import MEASURES
from spikeport.experiments.evaluate.plan import EvaluationSweep
from spikeport.experiments.evaluate.rows import Row, name_of
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Point


class TableRow(NamedTuple):
    """A row: its perturbation, falls with Wilson's interval, and the means of figures."""

    row: Row
    falls: int
    fell: Interval | None
    means: Mapping[str, Interval | None]

    @property
    def name(self) -> str:
        """The row's name."""
        return name_of(self.row)

    @property
    def fallen(self) -> str:
        """The falls among the finished episodes, as in "2 of 20"."""
        return f"{self.falls} of {self.fell.n if self.fell else 0}"


def table(evaluation: EvaluationSweep, folder: SweepFolder) -> list[TableRow]:
    """Return all rows, even without a finished episode; no rows if nothing is finished.

    Raises
    ------
    UsageError
        If an episode's file was altered.
    """
    found = [_metrics(evaluation, folder, row) for row in evaluation.rows]
    return list(map(_row, evaluation.rows, found)) if any(found) else []


def _metrics(evaluation: EvaluationSweep, folder: SweepFolder, row: Row) -> list[dict[str, Any]]:
    points = [evaluation.point(row, seed) for seed in evaluation.seeds]
    return [_episode(folder, point) for point in points if folder.holds(point)]


def _episode(folder: SweepFolder, point: Point) -> dict[str, Any]:
    metrics: dict[str, Any] = folder.read(point)["metrics"]
    figures = [metrics.get(name, "absent") for name in MEASURES]
    # A robot that falls early has None for its figures.
    if metrics.get("falls") not in (0, 1) or not all(_is_figure(one) for one in figures):
        raise UsageError(
            f"{folder.result_path(point)}: holds no figures of an episode; "
            "remove it to run its episode again"
        )
    return metrics


def _is_figure(value: object) -> bool:
    return value is None or (isinstance(value, int | float) and math.isfinite(value))


def _row(row: Row, metrics: list[dict[str, Any]]) -> TableRow:
    falls = sum(one["falls"] for one in metrics)
    means = {
        # Early falls have no figures: means are over the episodes that have them.
        name: of_mean([one[name] for one in metrics if one[name] is not None])
        for name in MEASURES
    }
    return TableRow(row, falls, of_share(falls, len(metrics)), means)


def as_json(rows: list[TableRow]) -> list[dict[str, object]]:
    """Return rows as ``result.json`` holds them."""
    return [
        {
            "row": one.name,
            "perturbation": dict(one.row),
            "falls": one.falls,
            "fell": one.fell and one.fell._asdict(),
            **{name: mean and mean._asdict() for name, mean in one.means.items()},
        }
        for one in rows
    ]


def markdown(rows: list[TableRow]) -> str:
    """Return the table in Markdown, with intervals after figures, and the figures' definitions."""
    headings = " | ".join(one.heading for one in MEASURES.values())
    lines = [
        f"| perturbation | falls | fell, 95 % | {headings} |",
        "|---" * (3 + len(MEASURES)) + "|",
    ]
    for one in rows:
        figures = " | ".join(_text(one.means[name]) for name in MEASURES)
        lines.append(f"| {one.name} | {one.fallen} | {_percent(one.fell)} | {figures} |")
    # With the names that `result.json` and `spikeport diff` have for them.
    meanings = (f"- *{one.heading}* (`{name}`): {one.definition}" for name, one in MEASURES.items())
    lines += ["", *meanings]
    return "\n".join(lines) + "\n"


def _percent(share: Interval | None) -> str:
    """Return the interval of a share; a dash where no episode is finished."""
    return f"{100 * (share.low or 0):.0f}-{100 * (share.high or 0):.0f} %" if share else "-"


def _text(mean: Interval | None) -> str:
    """Return a mean with half its interval; a dash where no episode has the figure."""
    if mean is None:
        return "-"
    if mean.high is None:
        return f"{mean.estimate:.3f}"
    return f"{mean.estimate:.3f} ± {mean.high - mean.estimate:.3f}"
