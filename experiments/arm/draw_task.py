"""The drawing task: the hand moves to where a stroke begins, then follows a pen along it.

    approach   x(t) = x_0 + (x_1 - x_0) (10 tau^3 - 15 tau^4 + 6 tau^5),  tau = t / T in [0, 1]
    drawing    ds/dt = v min(1, t / t_r, (T - t) / t_r),  s(T) = length of the stroke

The pen rests where the stroke begins, and also where it ends, for the hand that lags behind it.
"""

from dataclasses import dataclass

import numpy as np

from spikeport.experiments.arm.strokes import unit_stroke
from spikeport.experiments.curves import arc_length, interpolated, minimum_jerk
from spikeport.robot.times import PHYSICS_DT_S, ROUNDING_S

APPROACH_S = 1.5
REST_S = 0.5
RAMP_S = 0.5
"""Time in which the pen reaches its speed, and time in which it stops again."""
SHORTEST_S = 4.0
"""The shortest run: a second and a half of it is drawing."""


@dataclass(frozen=True)
class Sheet:
    """A sheet to draw digits on: an upright rectangle across the robot, at a constant x.

    Digits are written as the robot reads them: from its left to its right, which is towards -y.
    Lengths are in m, in the world frame; ``x_m``, ``y_m`` and ``z_m`` are the centre.
    """

    x_m: float = 0.35
    y_m: float = -0.20
    z_m: float = 1.24
    width_m: float = 0.14
    height_m: float = 0.20

    def place(self, unit: np.ndarray) -> np.ndarray:
        """Return (n, 3) world coordinates of points (n, 2) in the unit box."""
        right, up = ((unit - 0.5) * [self.width_m, self.height_m]).T
        return np.stack([np.full(len(unit), self.x_m), self.y_m - right, self.z_m + up], axis=1)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return points (n, 3) as the robot sees them, (n, 2): metres to the right and up."""
        return np.stack([self.y_m - points[:, 1], points[:, 2] - self.z_m], axis=1)

    def stroke(self, digit: int) -> np.ndarray:
        """Return points (n, 3) of a digit in the world, in the order they are drawn."""
        return self.place(unit_stroke(digit))


class Way:
    """A target that moves along a way, and then rests at its end.

    Parameters
    ----------
    places : (n, 3) array
        The place at each physics step, in m.
    """

    def __init__(self, places: np.ndarray) -> None:
        self._places = places
        self.target = places[0]

    def update(self, time_s: float, _hand: np.ndarray) -> None:
        """Move the target on."""
        step = min(round(time_s / PHYSICS_DT_S), len(self._places) - 1)
        self.target = self._places[step]


class DrawTask(Way):
    """A stroke, approached and drawn in a set time.

    Parameters
    ----------
    stroke : (n, 3) array
        Its points in m, close together.
    hand : (3,) array
        The hand's place at the start, in m.
    seconds : float
        Time of the whole run.
    """

    begin_s = APPROACH_S + REST_S
    """The time at which the pen begins to draw."""

    def __init__(self, stroke: np.ndarray, hand: np.ndarray, seconds: float) -> None:
        self.stroke = stroke
        draw_s = seconds - self.begin_s - REST_S
        approach = hand + np.outer(minimum_jerk(APPROACH_S), stroke[0] - hand)
        rest = np.repeat(stroke[:1], round(REST_S / PHYSICS_DT_S), axis=0)
        super().__init__(np.vstack([approach, rest, _along(stroke, draw_s)]))


def pen_is_down(since_s: np.ndarray | float) -> np.ndarray:
    """Return whether the pen is down at times (...) in s from the beginning of a drawing.

    Times are sums of steps: 400 steps of 5 ms add up to a little less than 2 s.
    """
    return np.asarray(since_s > DrawTask.begin_s - ROUNDING_S)


def _along(stroke: np.ndarray, seconds: float) -> np.ndarray:
    """Return the pen's place on a stroke at every physics step, (m, 3)."""
    times = np.arange(0.0, seconds + PHYSICS_DT_S, PHYSICS_DT_S)
    speed = np.clip(np.minimum(times, seconds - times) / RAMP_S, 0.0, 1.0)
    # Divided by the sum, so that the pen reaches the end with any time step.
    done = np.cumsum(speed) / speed.sum()
    length = arc_length(stroke)
    return interpolated(done, length / length[-1], stroke)
