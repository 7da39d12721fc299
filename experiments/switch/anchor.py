"""An anchor that holds the robot by its pelvis while the arm works, as in the paper.

    p(t) = p_0 + (p_1 - p_0) w(t / T),    w(tau) = 10 tau^3 - 15 tau^4 + 6 tau^5

The weld begins at the pose p_0 of the walking robot, and within T brings it to the pose p_1 of a
standing one: upright, at the place and heading of p_0, and as high as at the start of the run above
the floor beneath the lowest sole. So the robot stands when it is released, on uneven floors, too.
"""

from collections.abc import Iterator

import numpy as np

from spikeport.experiments.curves import minimum_jerk
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
        self._height_m = plant.standing_height_m
        self._moves: Iterator[np.ndarray] = iter(())

    def reset(self) -> None:
        """Note the height of the standing robot."""
        self._height_m = self._plant.standing_height_m
        self._moves = iter(())

    def update(self, holds: bool) -> None:
        """Weld the pelvis, or move the weld on, if the robot is to be held; else release it."""
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
        """Return poses of the pelvis with angles of the torso, (n, 8), at every physics step."""
        data = self._plant.data
        begin = np.append(data.qpos[:7], data.joint("torso").qpos)
        w, _, _, z = begin[3:7]
        turn = np.hypot(w, z)  # the norm of the part about the vertical
        floor_m = begin[2] - self._plant.standing_height_m
        # Upright: the part of the quaternion about x and y is left out.
        end = np.array([*begin[:2], floor_m + self._height_m, w / turn, 0, 0, z / turn, 0])
        # The last pose is exact with any time step.
        share = np.append(minimum_jerk(RAISING_S, self._plant.dt_s), 1.0)
        return begin + np.outer(share, end - begin)
