"""The reach-to-target task: a new random target as soon as the hand is within 4 cm of the last.

Source: paper, sec. 4.1. Its target area and gains are not published; the boxes are ours.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from spikeport.errors import UsageError, unknown
from spikeport.experiments.arm.region import Rehearsal
from spikeport.experiments.arm.settings import FARTHEST_M

SHOULDER_M = (0.0, -0.2135, 1.4989)
"""The right shoulder with the pelvis anchored at 1.06 m: centre of the reachable shell."""
REACHED_M = 0.04
MIN_JUMP_M = 0.10
REGION_SEEDS = (1000, 1001, 1002)
REGION_SECONDS = 15.0
"""The random runs that determine the region; no table in docs/ uses these seeds."""


@dataclass(frozen=True)
class TargetBox:
    """A box of targets: world coordinates, and limits of the distance from the shoulder, in m."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    shell_m: tuple[float, float] = (0.0, np.inf)

    def draw(self, rng: np.random.RandomState, last: np.ndarray) -> np.ndarray:
        """Return a random point of the box that is at least 10 cm from the last target."""
        while True:
            point = rng.uniform(self.low_m, self.high_m)
            # Ends with probability one: `find_box` refuses boxes too small for such a jump.
            if np.linalg.norm(point - last) >= MIN_JUMP_M and self.reachable(point):
                return point

    def grid(self, points: int, spacing_m: float = np.inf) -> np.ndarray:
        """Return the points (n, 3) within reach of a grid that spans the box.

        An edge has so many points, or more if they would be farther apart than ``spacing_m``.
        """
        edges = [
            np.linspace(low, high, max(points, 1 + math.ceil((high - low) / spacing_m)))
            for low, high in zip(self.low_m, self.high_m, strict=True)
        ]
        grid = np.stack(np.meshgrid(*edges), axis=-1).reshape(-1, 3)
        return grid[[self.reachable(point) for point in grid]]

    def reachable(self, point: np.ndarray) -> bool:
        """Return whether a point lies in the shell around the shoulder."""
        return bool(self.shell_m[0] <= np.linalg.norm(point - SHOULDER_M) <= self.shell_m[1])


BOXES = {
    "small": TargetBox((0.28, -0.34, 1.12), (0.42, -0.06, 1.36)),
    "large": TargetBox((0.20, -0.48, 1.05), (0.48, 0.05, 1.45), shell_m=(0.27, 0.56)),
}


def find_box(text: str) -> TargetBox:
    """Return the box with a name, or with the edges ``x0:x1,y0:y1,z0:z1`` in metres.

    Raises
    ------
    UsageError
        If the text is neither, an edge is beyond `FARTHEST_M`, or the box is too small for the next
        target to be 10 cm away wherever the last one was.
    """
    if text in BOXES:
        return BOXES[text]
    edges = _edges(text)
    if edges.shape != (3, 2) or not np.isfinite(edges).all():
        raise unknown("box", text, [*BOXES, "x0:x1,y0:y1,z0:z1 (m)"])
    low, high = edges.T
    if (np.abs(edges) > FARTHEST_M).any():
        raise UsageError(f"box {text}: each edge must be from -{FARTHEST_M:g} to {FARTHEST_M:g} m")
    for axis, (first, second) in zip("xyz", edges, strict=True):
        if second <= first:
            raise UsageError(
                f"box {text}: {axis} goes from {first:g} to {second:g} m, and must rise; cure: a "
                "second number above the first"
            )
    diagonal_m, least_m = np.linalg.norm(high - low), 2 * MIN_JUMP_M
    if diagonal_m <= least_m:
        raise UsageError(
            f"box {text}: its diagonal is {diagonal_m:g} m, and must exceed {least_m:g} m; cure: "
            "longer edges"
        )
    return TargetBox(tuple(low.tolist()), tuple(high.tolist()))


def _edges(text: str) -> np.ndarray:
    """Return the numbers of ``a:b,c:d``, row by row; no rows if the text has another form."""
    try:
        return np.array([[float(end) for end in edge.split(":")] for edge in text.split(",")])
    except ValueError:
        return np.empty((0, 2))


class ReachTask:
    """Random targets, each until it is reached.

    Parameters
    ----------
    box : TargetBox
        The box that targets are drawn from.
    seed : int or sequence of int
        Seed of the targets.
    hand : (3,) array
        The hand's place at the start, in m.
    """

    def __init__(self, box: TargetBox, seed: int | Sequence[int], hand: np.ndarray) -> None:
        self._box = box
        self._rng = np.random.RandomState(seed)
        self.reach_times_s: list[float] = []
        self.target = box.draw(self._rng, hand)

    def update(self, time_s: float, hand: np.ndarray) -> None:
        """Move on to a new target if the hand has reached this one."""
        if math.dist(self.target, hand) < REACHED_M:
            self.reach_times_s.append(time_s)
            self.target = self._box.draw(self._rng, self.target)


class GridTour:
    """Targets on a grid that fills a box, each for a fixed time, in random order.

    Parameters
    ----------
    box : TargetBox
        The box.
    points : int
        Grid points along each edge.
    dwell_s : float
        Time at each target.
    """

    def __init__(self, box: TargetBox, points: int = 4, dwell_s: float = 0.6) -> None:
        self._dwell_s = dwell_s
        # In random order the hand crosses the whole box between targets, not along its edges alone.
        self._targets = np.random.RandomState(0).permutation(box.grid(points))
        self.seconds = dwell_s * len(self._targets)
        self.target = self._targets[0]

    def update(self, time_s: float, _hand: np.ndarray) -> None:
        """Move on when the time at this target is over."""
        number = int(time_s / self._dwell_s)
        self.target = self._targets[min(number, len(self._targets) - 1)]


def rehearsals(box: TargetBox) -> list[Rehearsal]:
    """Return the runs that determine the region of a box.

    One run visits a grid that fills the box, so that no target lies outside the region. The others
    follow random targets, as the task does, but targets that no table in docs/ uses.
    """
    tour = GridTour(box)
    random = [
        Rehearsal(partial(ReachTask, box, seed), REGION_SECONDS, seed) for seed in REGION_SEEDS
    ]
    return [Rehearsal(lambda _hand: tour, tour.seconds, seed=0), *random]
