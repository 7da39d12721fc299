"""Floors that a robot walks on: flat, a slope, boxes of drawn heights, or smooth relief.

=======================  ===========================================================
``flat``                 a plane
``slope:DEGREES``        a plane that rises ahead of the robot; negative angles fall
``slope:DEGREES:SIDE``   a plane that rises in direction SIDE in degrees; 90 is to the left
``boxes:M``              boxes of 0.4 m, each with a random height from 0 to M m
``relief:M``             waves of about 1 m, from 0 to M m
=======================  ===========================================================

An uneven floor is a square of 24 m on a flat floor, drawn once. The seed of a run draws the place
on it where the robot starts, so that it goes on for 7.7 m from there, at least.
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from spikeport.arrays import Floats
from spikeport.errors import UsageError
from spikeport.robot.engine import mujoco

FLAT = "flat"
BODY = "terrain"
STEEPEST_DEGREES = 30.0
HIGHEST_M = 0.3
SIZE_M = 24.0
BOX_M, GRID_M = 0.4, 0.05
WAVE_M = 0.2
"""Standard deviation of the filter of relief, in m: its waves are about five times as long."""
SHIFT_M = 3.0
"""The largest distance of a start from the middle of an uneven floor, along x and y."""
REACH_M = SIZE_M / 2 - math.sqrt(2) * SHIFT_M
"""The distance from a start up to which an uneven floor goes on, however it is laid."""
DEEP_M = 0.5
"""The depth of boxes below their tops."""
BELOW_M = 0.001
"""The depth of the flat floor below an uneven one, so that a foot does not touch both."""
SEED = 0


class Floor(Protocol):
    """A floor that a robot can walk on; it goes on up to ``reach_m`` from a start, at least."""

    @property
    def reach_m(self) -> float:
        """The distance from a start up to which the floor goes on."""

    @property
    def is_plane(self) -> bool:
        """True if the floor is a plane."""

    def lay(self, spec: mujoco.MjSpec) -> None:
        """Add the floor to the model of a robot on a flat floor."""

    def begin(self, model: mujoco.MjModel, rng: np.random.RandomState) -> "Floor":
        """Place the floor for a new run, and return the placed floor."""

    def height_m(self, x: Floats, y: Floats) -> Floats:
        """Return heights (...) above the start's level at places (...), in m."""


@dataclass(frozen=True)
class Slope:
    """A plane that rises by an angle in a direction."""

    angle_rad: float = 0.0
    direction_rad: float = 0.0

    @property
    def reach_m(self) -> float:
        """Infinite: a plane has no edge."""
        return math.inf

    @property
    def is_plane(self) -> bool:
        """True."""
        return True

    def lay(self, spec: mujoco.MjSpec) -> None:
        """Tilt the floor."""
        if self.angle_rad:
            half, c, s = self.angle_rad / 2, np.cos(self.direction_rad), np.sin(self.direction_rad)
            # Half the angle, about the horizontal axis at right angles to the direction of
            # rising.
            spec.geom("floor").quat = [np.cos(half), np.sin(half) * s, -np.sin(half) * c, 0]

    def begin(self, model: mujoco.MjModel, rng: np.random.RandomState) -> "Slope":
        """Return the slope, which is the same everywhere."""
        return self

    def height_m(self, x: Floats, y: Floats) -> Floats:
        """Return heights, tan(angle) (x cos(direction) + y sin(direction))."""
        rise, c, s = self._rise
        return np.asarray(rise * (x * c + y * s))

    @functools.cached_property
    def _rise(self) -> tuple[float, float, float]:
        """The rise a metre, and the direction's unit vector."""
        turn_rad = self.direction_rad
        return np.tan(self.angle_rad), np.cos(turn_rad), np.sin(turn_rad)


LEVEL = Slope()
"""The floor without a terrain."""


class Pose(NamedTuple):
    """Place and turn of an uneven floor in the world, in m and rad."""

    x: float = 0.0
    y: float = 0.0
    turn_rad: float = 0.0

    def inside(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return places of the world in the floor's own frame."""
        c, s = np.cos(self.turn_rad), np.sin(self.turn_rad)
        x, y = np.asarray(x - self.x), np.asarray(y - self.y)
        return np.asarray(c * x + s * y), np.asarray(c * y - s * x)


MIDDLE = Pose()
"""The pose of a floor whose middle is at the world's origin."""


@dataclass(frozen=True)
class Uneven:
    """A floor of boxes, or of smooth waves, of heights from 0 to ``highest_m``."""

    highest_m: float
    smooth: bool
    pose: Pose = MIDDLE

    @property
    def reach_m(self) -> float:
        """The distance from every start to the nearest edge, at least."""
        return REACH_M

    @property
    def is_plane(self) -> bool:
        """False."""
        return False

    @property
    def cell_m(self) -> float:
        """The distance between neighbouring heights of the table."""
        return GRID_M if self.smooth else BOX_M

    def table_m(self) -> Floats:
        """Return heights (n, n), rows along y and columns along x."""
        return np.asarray(self.highest_m * _drawn(self.smooth))

    def lay(self, spec: mujoco.MjSpec) -> None:
        """Lay the floor above the flat one."""
        body = spec.worldbody.add_body(name=BODY)
        # MuJoCo's contact bits: the robot touches this floor, and boxes do not touch each other.
        touched = {"contype": 1, "conaffinity": 0, "rgba": [0.6, 0.62, 0.65, 1]}
        table, half = self.table_m(), SIZE_M / 2
        if self.smooth:
            n = len(table)
            field = spec.add_hfield(
                name=BODY, nrow=n, ncol=n, size=[half, half, self.highest_m, DEEP_M]
            )
            field.userdata = table.ravel()  # scaled such that the highest is `highest_m`
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=BODY, **touched)
        else:
            size = [BOX_M / 2, BOX_M / 2, DEEP_M / 2]
            for (row, column), height in np.ndenumerate(table):
                x, y = (np.array([column, row]) + 0.5) * BOX_M - half
                place = [x, y, height - DEEP_M / 2]
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=place, **touched)
        # The flat floor goes on beyond the edge of the uneven one.
        spec.geom("floor").pos = [0, 0, -BELOW_M]

    def begin(self, model: mujoco.MjModel, rng: np.random.RandomState) -> "Uneven":
        """Move and turn the floor under the robot."""
        x, y = rng.uniform(-SHIFT_M, SHIFT_M, 2)
        pose = Pose(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
        body = model.body(BODY)
        body.pos[:2] = pose.x, pose.y
        body.quat[:] = np.cos(pose.turn_rad / 2), 0, 0, np.sin(pose.turn_rad / 2)
        return Uneven(self.highest_m, self.smooth, pose)

    def height_m(self, x: Floats, y: Floats) -> Floats:
        """Return heights; 0 beyond the edge."""
        from scipy.ndimage import map_coordinates  # slow to import, and flat floors need none

        places = (np.stack(self.pose.inside(x, y)) + SIZE_M / 2) / self.cell_m
        # Relief is interpolated between points, a box is level.
        column, row = places if self.smooth else np.floor(places)
        at = np.stack((row, column))
        drawn = map_coordinates(_drawn(self.smooth), at, order=int(self.smooth), cval=0.0)
        return np.asarray(self.highest_m * drawn)


@functools.cache
def _drawn(smooth: bool) -> Floats:
    """Return heights (n, n) of boxes, or of the points of a relief, as shares of the largest."""
    from scipy.ndimage import gaussian_filter  # as in `Uneven.height_m`

    n = round(SIZE_M / (GRID_M if smooth else BOX_M)) + int(smooth)
    drawn = np.random.RandomState(SEED).uniform(size=(n, n))
    if smooth:
        # Smoothing lowers the waves, so they are stretched to cover 0 to 1 again.
        drawn = gaussian_filter(drawn, WAVE_M / GRID_M, mode="wrap")
        drawn = (drawn - drawn.min()) / (drawn.max() - drawn.min())
    drawn.setflags(write=False)
    return drawn


def find_terrain(text: str) -> Floor:
    """Return the floor that a text names.

    Raises
    ------
    UsageError
        If the text names no floor, or one that is too steep or too high.
    """
    kind, *numbers = text.split(":")
    values = _numbers(text, numbers)
    if kind == FLAT and not values:
        return Slope()
    if kind == "slope" and len(values) in (1, 2):
        _check(text, abs(values[0]), STEEPEST_DEGREES, "degrees")
        return Slope(*np.radians(values).tolist())
    if kind in ("boxes", "relief") and len(values) == 1:
        if values[0] <= 0:
            raise UsageError(f"terrain={text}: {values[0]:g} m, must be above 0; cure: {FLAT}")
        _check(text, values[0], HIGHEST_M, "m")
        return Uneven(values[0], kind == "relief")
    raise _no_terrain(text)


def check_reach(text: str, farthest_m: float) -> None:
    """Refuse ways that lead farther from their start than the floor that a text names goes on."""
    reach_m = find_terrain(text).reach_m
    if farthest_m > reach_m:
        raise UsageError(
            f"terrain={text}: an uneven floor goes on for {reach_m:.2f} m from a start, and this "
            f"robot would leave it, up to {farthest_m:.2f} m away; cure: a closed path, or a "
            "shorter one"
        )


def _numbers(text: str, numbers: list[str]) -> list[float]:
    try:
        values = [float(number) for number in numbers]
    except ValueError:
        raise _no_terrain(text) from None
    if not np.isfinite(values).all():
        raise _no_terrain(text)
    return values


def _no_terrain(text: str) -> UsageError:
    return UsageError(
        f"terrain={text}: unknown terrain; expected {FLAT}, slope:DEGREES, slope:DEGREES:SIDE, "
        "boxes:M or relief:M, such as boxes:0.01"
    )


def _check(text: str, used: float, limit: float, unit: str) -> None:
    if used > limit:
        raise UsageError(f"terrain={text}: {used:g} {unit}, limit {limit:g} {unit}")
