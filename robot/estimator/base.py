"""The interface of motion estimators, and the fix: a measurement of the place from outside."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState


class Fix(NamedTuple):
    """Place of the pelvis as measured from outside, by motion capture or third-party odometry.

    Attributes
    ----------
    position : ndarray, (3,)
        Origin of the pelvis in the world, m.
    yaw_rad : float or None
        Direction of the pelvis' x axis about the vertical; None where it is not measured.
    velocity : ndarray or None, (3,)
        The pelvis' velocity in the world, m/s; None if not measured. Filters estimate their own.
    """

    position: np.ndarray
    yaw_rad: float | None = None
    velocity: np.ndarray | None = None


class StateEstimator(Protocol):
    """Estimator of the robot's motion, observation by observation."""

    def reset(self, sensors: Sensors, fix: Fix | None = None) -> RobotState:
        """Start over, and return the motion at an observation.

        Without a fix, the pelvis is above the world's origin with its lowest sole at height 0, and
        its heading is that of the IMU. Later fixes are in the frame of the fix at the reset,
        so a caller that has fixes must also give one here.
        """

    def update(
        self, sensors: Sensors, fix: Fix | None = None, between: Sequence[Sensors] = ()
    ) -> RobotState:
        """Return the motion at the next observation, with a fix if there is one.

        ``between`` are the sensors since the last observation, the oldest first, of a robot that is
        observed less often than it measures. A filter integrates their IMU as well.
        """

    @property
    def place_deviation_m(self) -> float | None:
        """The estimator's standard deviation of the place in the plane; None if unknown.

        It is the root of the sum of the variances along x and y, so it is comparable to the
        distance from the true place.
        """
