"""The plan of an evaluation: rows of perturbations, each in episodes of several seeds."""

from dataclasses import dataclass
from typing import ClassVar

from spikeport.experiments.evaluate.rows import NOMINAL, Row
from spikeport.experiments.sweep.plan import SEED, Point, Sweep


@dataclass(frozen=True)
class EvaluationSweep(Sweep):
    """A sweep whose points are rows of perturbations, not products of values."""

    kind: ClassVar[str] = "evaluation"
    rows: tuple[Row, ...] = (NOMINAL,)

    def points(self) -> list[Point]:
        """Return all episodes, seed by seed, so that the first results cover all rows."""
        return [self.point(row, seed) for seed in self.seeds for row in self.rows]

    def point(self, row: Row, seed: int) -> Point:
        """Return an episode of a row."""
        return Point(self, {**row, SEED: seed})
