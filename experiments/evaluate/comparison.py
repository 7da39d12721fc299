"""The comparison of two robustness tables: figures that differ by more than chance.

Falls differ if Fisher's exact test of both counts gives p < 0.05, means if

    |b - a| > sqrt(h_a² + h_b²)        h: half of a mean's interval of 95 %

Episodes count as independent of each other, also those of equal seeds in both tables.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, NonNegativeInt, model_validator
from scipy import stats

from spikeport.constants import MOST_POINTS
from spikeport.experiments.evaluate.interval import CONFIDENCE
from spikeport.files import Line, read_json, read_model

KIND = "evaluate "
"""The beginning of ``experiment`` in the ``result.json`` of an evaluation."""

Episodes = Annotated[int, Field(ge=1, le=MOST_POINTS)]


class Estimate(BaseModel):
    """An estimate from ``n`` episodes with its interval, see `Interval`."""

    estimate: FiniteFloat
    low: FiniteFloat | None
    high: FiniteFloat | None
    n: Episodes

    @property
    def half(self) -> float | None:
        """Half of the interval; None if a single episode has the figure."""
        return None if self.high is None else self.high - self.estimate

    @property
    def text(self) -> str:
        """The estimate, with half of its interval if it has one."""
        interval = "" if self.half is None else f" ± {self.half:.3f}"
        return f"{self.estimate:.3f}{interval}"


class RowData(BaseModel):
    """A row of the table; its means are extra keys."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[Line, Estimate | None]

    row: Line
    perturbation: dict[str, Any]
    falls: NonNegativeInt
    fell: Estimate | None

    @model_validator(mode="after")
    def _check_falls(self) -> "RowData":
        if self.falls > self.episodes:
            raise ValueError(f"{self.falls} falls in {self.episodes} episodes")
        return self

    @property
    def episodes(self) -> int:
        """The number of finished episodes."""
        return self.fell.n if self.fell else 0

    @property
    def fallen(self) -> str:
        """The falls among the finished episodes, as in "2 of 20"."""
        return f"{self.falls} of {self.episodes}"

    @property
    def means(self) -> dict[str, Estimate | None]:
        """The means of the row's figures."""
        return self.__pydantic_extra__


class EvaluationData(BaseModel):
    """The ``result.json`` of an evaluation."""

    experiment: Line
    backend: Line
    seconds: FiniteFloat
    settings: dict[Line, bool | int | FiniteFloat | Line]
    rows: list[RowData]
    chip: Line | None = None
    pipeline: Line | None = None
    seeds: list[int] = []
    files: dict[Line, Line] = {}
    versions: dict[Line, Line | None] = {}

    @property
    def conditions(self) -> dict[str, object]:
        """Everything but the policy's conduct, by name."""
        return {
            "experiment": self.experiment,
            "backend": self.backend,
            "chip": self.chip,
            "pipeline": self.pipeline,
            "seconds": self.seconds,
            **self.settings,
            "seeds": f"{min(self.seeds)} to {max(self.seeds)}" if self.seeds else None,
            **{f"digest of {name}": digest for name, digest in self.files.items()},
            **{f"version of {name}": version for name, version in self.versions.items()},
        }


class Difference(NamedTuple):
    """A figure of a row, or a condition, that differs, in words."""

    figure: str
    a: str
    b: str
    change: str = ""


class Comparison(NamedTuple):
    """Differences of two evaluations, and the number of figures that were compared."""

    differences: list[Difference]
    compared: int


def is_evaluation(path: Path) -> bool:
    """Return whether a JSON file is the result of an evaluation.

    Raises
    ------
    UsageError
        The file cannot be read, or is not JSON.
    """
    content = read_json(path)
    return isinstance(content, dict) and str(content.get("experiment")).startswith(KIND)


def compare(a: Path, b: Path) -> Comparison:
    """Return the conditions, rows and figures in which the results of two evaluations differ.

    Raises
    ------
    UsageError
        A file cannot be read, or is not the result of an evaluation.
    """
    one, other = (read_model(path, EvaluationData, "evaluation", read=read_json) for path in (a, b))
    rows, others = ({row.row: row for row in each.rows} for each in (one, other))
    shared = [(row, others[name]) for name, row in rows.items() if name in others]
    tested = [figure for pair in shared for figure in _figures(*pair)]
    differences = [
        *_conditions(one, other),
        *(Difference(name, f"{row.fallen} fell", "-") for name, row in _only_in(rows, others)),
        *(Difference(name, "-", f"{row.fallen} fell") for name, row in _only_in(others, rows)),
        *(figure for figure, differs in tested if differs),
    ]
    return Comparison(differences, len(tested))


def _only_in(rows: dict[str, RowData], others: dict[str, RowData]) -> list[tuple[str, RowData]]:
    return [(name, row) for name, row in rows.items() if name not in others]


def _conditions(a: EvaluationData, b: EvaluationData) -> Iterator[Difference]:
    left, right = a.conditions, b.conditions
    for name in {**left, **right}:
        values = [each.get(name) for each in (left, right)]
        if values[0] != values[1]:
            yield Difference(name, *("-" if value is None else str(value) for value in values))


def _figures(a: RowData, b: RowData) -> Iterator[tuple[Difference, bool]]:
    """Yield each figure that both rows have, and whether it differs by more than chance."""
    if a.episodes and b.episodes:
        p = stats.fisher_exact([[row.falls, row.episodes - row.falls] for row in (a, b)]).pvalue
        yield Difference(f"{a.row}: falls", a.fallen, b.fallen, f"p = {p:.2g}"), p < 1 - CONFIDENCE
    for name, left in a.means.items():
        right = b.means.get(name)
        if left and right and left.half is not None and right.half is not None:
            change, half = right.estimate - left.estimate, math.hypot(left.half, right.half)
            texts = (left.text, right.text, f"{change:+.3f} ± {half:.3f}")
            yield Difference(f"{a.row}: {name}", *texts), abs(change) > half
