"""Holds the robot by its pelvis while the arm works, as the paper does.

    p(t) = p_0 + (p_1 - p_0) w(t / T),    w(tau) = 10 tau^3 - 15 tau^4 + 6 tau^5

The weld begins where the walking robot is, p_0, and within T brings it to where it stood at the
start of the run, p_1: at the same height above the floor and upright, but in place and heading of
now. It stands when it is let go.
"""

from collections.abc import Iterator

import numpy as np

from spikeport.experiments.arm.draw_task import minimum_jerk
from spikeport.robot.plant import Plant

RAISING_S = 1.0


class Anchor:
    """The weld of a plant.

    Parameters
    ----------
    plant : Plant
        The robot.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._height_m = plant.height_m
        self._moves: Iterator[np.ndarray] = iter(())

    def reset(self) -> None:
        """Note how high the robot stands."""
        self._height_m = self._plant.height_m
        self._moves = iter(())

    def update(self, holds: bool) -> None:
        """Weld the pelvis, or go on with it, where the robot is to be held; else let it go."""
        if not holds:
            if self._plant.anchored:
                self._plant.release()
            return
        if not self._plant.anchored:
            self._moves = iter(self._way())
        # One pose a step; at the end of the way the weld stays where it is.
        for *pose, torso_rad in self._moves:
            self._plant.anchor(pose, torso_rad)
            break

    def _way(self) -> np.ndarray:
        """Return (n, 8) poses of the pelvis, and angles of the torso, at every physics step."""
        data = self._plant.data
        begin = np.append(data.qpos[:7], data.joint("torso").qpos)
        w, _, _, z = begin[3:7]
        turn = np.hypot(w, z)  # what is left of the rotation about the vertical
        floor_m = begin[2] - self._plant.height_m
        # Upright: the part of the quaternion about x and y is left out.
        end = np.array([*begin[:2], floor_m + self._height_m, w / turn, 0, 0, z / turn, 0])
        # The last pose is exact, whatever the step.
        share = np.append(minimum_jerk(RAISING_S, self._plant.dt_s), 1.0)
        return begin + np.outer(share, end - begin)
