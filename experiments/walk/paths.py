"""Paths to walk: the place and velocity to take at every moment, from the robot's start.

    p(t),  v(t) = dp/dt

Frame: origin and x axis are place and heading of the robot at the start. The built-in paths are
walked at constant speed; a user's own path has its own times.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.spatial import cKDTree

from spikeport.errors import UsageError, unknown
from spikeport.experiments.curves import arc_length, interpolated
from spikeport.experiments.walk.path_file import ENDING, FASTEST_RAD_S, read_path

SPACING_M = 0.005
"""Distance between the points that represent a path."""
ROUNDING = 0.01
"""The rounding error that a curvature between points may have."""


@dataclass(frozen=True)
class WalkPath:
    """A path, as points (n, 2) in m at times (n,) in s; ``closed`` if it starts over at the end.

    Its speed is reached in ``ramp_s``: it is walked as p(w(t)), dw/dt = min(1, t / ramp_s).
    """

    time_s: np.ndarray
    points: np.ndarray
    closed: bool = False
    ramp_s: float = 0.0

    def at(self, time_s: float) -> np.ndarray:
        """Return (4,) position in m and velocity in m/s; beyond an open end, the last ones."""
        if time_s < self.ramp_s:
            pace = time_s / self.ramp_s
            x, y, vx, vy = self._at(self._walked_s(time_s)).tolist()
            return np.array((x, y, pace * vx, pace * vy))
        return self._at(self._walked_s(time_s))

    def _walked_s(self, time_s: float) -> float:
        """Return w(t), the time in which the path is walked as far without a ramp."""
        if time_s < self.ramp_s:
            return time_s / self.ramp_s * time_s / 2
        return time_s - self.ramp_s / 2

    def _at(self, time_s: float) -> np.ndarray:
        """Return position and velocity (4,) without the ramp."""
        end_s = self.time_s.item(-1)
        time_s = time_s % end_s if self.closed else min(time_s, end_s)
        # The piece from point i - 1 to i, also at the first and the last moment.
        i = min(max(int(self.time_s.searchsorted(time_s)), 1), len(self.time_s) - 1)
        # plain numbers: several times faster than arrays of two
        before_s, after_s = self.time_s[i - 1 : i + 1].tolist()
        (x, y), (next_x, next_y) = self.points[i - 1 : i + 1].tolist()
        span, since = after_s - before_s, time_s - before_s
        vx, vy = (next_x - x) / span, (next_y - y) / span
        return np.array((x + since * vx, y + since * vy, vx, vy))

    def laid(self, place: np.ndarray, heading_rad: float) -> "WalkPath":
        """Return the path for a robot that starts at a place (2,) in m with a heading."""
        c, s = np.cos(heading_rad), np.sin(heading_rad)
        return replace(self, points=place + self.points @ np.array([[c, s], [-s, c]]))

    def farthest_m(self, seconds: float) -> float:
        """Return the largest distance in m from the origin in the first seconds."""
        passed = self.points[self.time_s <= self._walked_s(seconds)]
        places = np.vstack((passed, self.at(seconds)[:2]))
        return float(np.linalg.norm(places, axis=1).max())

    def distances_m(self, places: np.ndarray) -> np.ndarray:
        """Return (n,) distances in m of places (n, 2) from the nearest place on the path."""
        dense = self._dense()
        nearest = cKDTree(dense).query(places)[1]
        # The nearest place lies on one of the two pieces that meet in the nearest point. The point
        # itself is 1.4 mm (rms) from places that are on the path.
        before, after = np.maximum(nearest - 1, 0), np.minimum(nearest, len(dense) - 2)
        distances = [_distances_m(places, dense[i], dense[i + 1]) for i in (before, after)]
        nearest_m: np.ndarray = np.min(distances, axis=0)
        return nearest_m

    def _dense(self) -> np.ndarray:
        arc_m = arc_length(self.points)
        s = np.linspace(0, arc_m[-1], 2 + int(arc_m[-1] / SPACING_M))
        return interpolated(s, arc_m, self.points)


def _distances_m(places: np.ndarray, begins: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the distance of each place from its own piece; all arguments are (n, 2)."""
    along, since = ends - begins, places - begins
    # A path that rests has pieces without length.
    length2 = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
    share = (since * along).sum(axis=1) / length2
    aside = since - np.clip(share, 0, 1)[:, np.newaxis] * along
    return np.asarray(np.hypot(*aside.T))


def _line(length_m: float) -> np.ndarray:
    return np.array([[0.0, 0.0], [length_m, 0.0]])


def _s_curve(length_m: float) -> np.ndarray:
    """Return waves of 8 m, 1.5 m to either side."""
    x = np.arange(0, length_m + SPACING_M, SPACING_M)
    return np.stack((x, 1.5 * np.sin(2 * np.pi * x / 8)), axis=1)


def _figure_eight(_length_m: float) -> np.ndarray:
    """Return Bernoulli's lemniscate, 6 m long, from its middle; its turns have radii from 1 m."""
    t = np.linspace(np.pi / 2, 5 * np.pi / 2, 4001)
    # t from pi/2 on, so that the walk begins in the middle, where the curve is straight.
    x = 3 * np.cos(t) / (1 + np.sin(t) ** 2)
    return np.stack((x, x * np.sin(t)), axis=1)


_TURN_RADIUS_M = 0.65
_STRAIGHTS_M = (1.35, 0.7, 0.7, 0.7, 0.7, 2.7, 1.35)
_QUARTER_TURNS = (1, 1, -1, 1, 1, 1)


def _loop(_length_m: float) -> np.ndarray:
    """Return a loop shaped like an L, of straights and quarter turns to left (1) or right (-1).

    It replaces the paper's path, of which the paper states a single place, where its robot ends:
    near (-1, 1). This path passes 1 m from there.
    """
    arc_m = _TURN_RADIUS_M * np.pi / 2
    lengths = np.full(2 * len(_STRAIGHTS_M) - 1, arc_m)
    lengths[::2] = _STRAIGHTS_M
    turns = np.zeros(len(lengths))
    turns[1::2] = _QUARTER_TURNS
    ends = np.cumsum(lengths)
    s = np.linspace(0, ends[-1], 4000)
    heading = np.pi / 2 * np.interp(s, np.append(0, ends), np.append(0, np.cumsum(turns)))
    direction = np.stack((np.cos(heading), np.sin(heading)), axis=1)
    return np.asarray(cumulative_trapezoid(direction, s, axis=0, initial=0))


SHAPES: dict[str, tuple[Callable[[float], np.ndarray], bool]] = {
    "line": (_line, False),
    "s-curve": (_s_curve, False),
    "figure-eight": (_figure_eight, True),
    "loop": (_loop, True),
}
"""For each built-in path: points of at least a length, and whether the path is closed."""
ALIASES = {"paper": "loop"}
"""Former names of paths."""


def find_path(name: str, speed_m_s: float, seconds: float, ramp_s: float = 0.0) -> WalkPath:
    """Return a built-in path at a speed, long enough for a time; or the path of a file.

    Raises
    ------
    UsageError
        If there is no path of that name, the robot cannot turn so fast, or the robot cannot follow
        the path of a file for so long, or that path is to have a ramp.
    """
    if name.endswith(ENDING):
        if ramp_s:
            raise UsageError(
                f"ramp={ramp_s:g}: '{name}' has times of its own; cure: leave the ramp out, and "
                "let its times begin slowly"
            )
        return WalkPath(*read_path(Path(name), seconds))
    name = ALIASES.get(name, name)
    if name not in SHAPES:
        raise unknown("path", name, [*SHAPES, "FILE.csv"])
    shape, closed = SHAPES[name]
    points = _from_the_robot(shape(speed_m_s * seconds))
    _check_turns(name, points, speed_m_s)
    return WalkPath(arc_length(points) / speed_m_s, points, closed, ramp_s)


def _check_turns(name: str, points: np.ndarray, speed_m_s: float) -> None:
    arc_m, heading = arc_length(points), np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    # Headings are those of pieces, and so at their middles.
    between_m = np.diff((arc_m[1:] + arc_m[:-1]) / 2)
    sharpest = np.max(np.abs(np.diff(heading)) / between_m, initial=0.0)
    if speed_m_s * sharpest > FASTEST_RAD_S * (1 + ROUNDING):
        raise UsageError(
            f"path '{name}': turns by {speed_m_s * sharpest:.2f} rad/s at {speed_m_s:g} m/s, limit "
            f"{FASTEST_RAD_S:g} rad/s, for which the policy is trained; cure: a speed of at most "
            f"{FASTEST_RAD_S / sharpest:.2f} m/s"
        )


def _from_the_robot(points: np.ndarray) -> np.ndarray:
    """Turn and move points such that they leave the origin along x."""
    x, y = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    return np.asarray((points - points[0]) @ np.array([[x, -y], [y, x]]))
