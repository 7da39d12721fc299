"""Uneven ground under each of many robots, as one plane below each foot.

    h(x, y) = slope . (x, y) + relief sin(k . (x, y) + phase) + box of the square that (x, y) is in

A foot touches the ground only at its heel and its toe, so a plane through both points stands for
the ground; planes are the cheapest shapes for collisions. A plane follows its foot while the foot
is in the air. A foot that is too low for a box passes through it: robots do not stumble over boxes.
"""

from dataclasses import dataclass

import numpy as np

from spikeport.arrays import Flags, Floats
from spikeport.robot.engine import mujoco

SQUARES = 64
"""Different boxes along x and along y, after which they recur."""


@dataclass(frozen=True)
class Terrain:
    """The ranges of uniform draws of a robot's ground.

    Attributes
    ----------
    rough : float
        Share of the robots whose ground is not level and even.
    slope_rad : float
        Largest slope, in any direction.
    relief_m : float
        Largest amplitude of a wave, half of its height from trough to crest.
    wave_m : (float, float)
        Shortest and longest wave.
    box_m : float
        Height of the highest box.
    square_m : (float, float)
        Smallest and largest side of the boxes' squares.
    """

    rough: float = 0.0
    slope_rad: float = 0.0
    relief_m: float = 0.0
    wave_m: tuple[float, float] = (0.6, 3.0)
    box_m: float = 0.0
    square_m: tuple[float, float] = (0.2, 0.8)


class Ground:
    """The ground of n robots.

    Parameters
    ----------
    n : int
        Number of robots.
    rng : Generator
        Draws their grounds.

    Attributes
    ----------
    even : ndarray of bool, (n,)
        True if a robot's ground is level and even.
    """

    def __init__(self, n: int, rng: np.random.Generator) -> None:
        self._rng = rng
        self._slope, self._wave = np.zeros((2, n, 2))
        self._relief, self._phase = np.zeros((2, n))
        self._square = np.ones(n)
        self._boxes = np.zeros((n, SQUARES, SQUARES))
        self.even = np.ones(n, bool)

    def draw(self, which: Flags, terrain: Terrain) -> None:
        """Draw new grounds for some robots, ``which (n,)``."""
        k, rng = int(np.count_nonzero(which)), self._rng
        rough = rng.random(k) < terrain.rough
        self.even[which] = ~rough
        steepness = np.tan(terrain.slope_rad * rng.random(k)) * rough
        self._slope[which] = steepness[:, None] * _directions(rng, k)
        self._relief[which] = terrain.relief_m * rng.random(k) * rough
        length = rng.uniform(*terrain.wave_m, k)
        self._wave[which] = 2 * np.pi / length[:, None] * _directions(rng, k)
        self._phase[which] = rng.uniform(-np.pi, np.pi, k)
        self._square[which] = rng.uniform(*terrain.square_m, k)
        highest = terrain.box_m * rng.random(k) * rough
        shape = (k, SQUARES, SQUARES)
        # Drawn as float32: half the random bits of a table of 4,096 heights for each robot.
        self._boxes[which] = highest[:, None, None] * rng.random(shape, dtype=np.float32)

    def height_m(self, xy: Floats) -> Floats:
        """Return the height of the ground at points ``(n, k, 2)``, ``(n, k)``."""
        wave = np.einsum("nki,ni->nk", xy, self._wave) + self._phase[:, None]
        square = np.floor(xy / self._square[:, None, None]).astype(int) % SQUARES
        robots = np.arange(len(xy))[:, None]
        return np.asarray(
            np.einsum("nki,ni->nk", xy, self._slope)
            + self._relief[:, None] * np.sin(wave)
            + self._boxes[robots, square[..., 0], square[..., 1]]
        )


def _directions(rng: np.random.Generator, k: int) -> Floats:
    angle = rng.uniform(-np.pi, np.pi, k)
    return np.stack((np.cos(angle), np.sin(angle)), axis=1)


class Planes:
    """The planes below the feet of n robots.

    Parameters
    ----------
    models : list of MjModel
        The robots' models, which hold the planes.
    planes : (int, int)
        The numbers of the planes' geoms, for the left foot and the right one.
    """

    def __init__(self, models: list[mujoco.MjModel], planes: tuple[int, int]) -> None:
        # Views into the models, which MuJoCo reads in the next step.
        self._places = [model.geom_pos[plane] for model in models for plane in planes]
        self._turns = [model.geom_quat[plane] for model in models for plane in planes]

    def lay(self, which: Flags, place: Floats, forward: Floats) -> None:
        """Lay the planes of some feet.

        Parameters
        ----------
        which : ndarray of bool, (n, 2)
            The feet whose planes are laid.
        place : ndarray, (n, 2, 3)
            A point of the plane.
        forward : ndarray, (n, 2, 3)
            A unit vector in the plane, along the foot; at right angles to it, the plane is level.
        """
        laid = zip(np.flatnonzero(which), place[which], _turns(forward[which]), strict=True)
        for i, position, turn in laid:
            self._places[i][:], self._turns[i][:] = position, turn


def _turns(forward: Floats) -> Floats:
    """Return quaternions that turn x to ``forward (..., 3)`` and leave y level."""
    x, y, z = np.moveaxis(forward, -1, 0)
    yaw, pitch = np.arctan2(y, x) / 2, -np.arcsin(np.clip(z, -1, 1)) / 2
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.stack((cy * cp, -sy * sp, cy * sp, sy * cp), axis=-1)
