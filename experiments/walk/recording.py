"""What is recorded of a walking robot, and when it has fallen."""

from typing import NamedTuple

import numpy as np

from spikeport.robot.walk_interface import PARTS

LOWEST_M = 0.7
LARGEST_TILT_RAD = np.pi / 4


def fallen(height_m: float, upright: float) -> bool:
    """Whether the pelvis is below 0.7 m or tilted by more than 45 degrees.

    ``upright`` is the share of its vertical axis that points upwards, cos(tilt).
    """
    return height_m < LOWEST_M or upright < np.cos(LARGEST_TILT_RAD)


class Sample(NamedTuple):
    """One physics step.

    ``observation`` (69,) is the last one, before it is clipped; ``reference`` (4,) position and
    velocity to take, ``state`` (5,) heading, position and velocity, world frame; ``action`` (19,);
    ``command`` (2,) forward speed and yaw rate; ``on_floor`` (2,) left and right foot.
    """

    time_s: float
    observation: np.ndarray
    reference: np.ndarray
    state: np.ndarray
    action: np.ndarray
    command: np.ndarray
    height_m: float
    on_floor: np.ndarray


class Recording(NamedTuple):
    """All physics steps of a run: as `Sample`, each with n rows."""

    time_s: np.ndarray
    observation: np.ndarray
    reference: np.ndarray
    state: np.ndarray
    action: np.ndarray
    command: np.ndarray
    height_m: np.ndarray
    on_floor: np.ndarray

    @property
    def position_m(self) -> np.ndarray:
        """(n, 2) where the robot is."""
        return self.state[:, 1:3]

    @property
    def speed_m_s(self) -> np.ndarray:
        """(n,) its speed along its heading."""
        heading, velocity = self.state[:, 0], self.state[:, 3:]
        return np.cos(heading) * velocity[:, 0] + np.sin(heading) * velocity[:, 1]

    @property
    def yaw_rate_rad_s(self) -> np.ndarray:
        """(n,) its angular velocity about the vertical: -g . omega."""
        down, omega = (self.observation[:, PARTS[k]] for k in ("gravity", "angular velocity"))
        return -np.einsum("nd,nd->n", down, omega)
