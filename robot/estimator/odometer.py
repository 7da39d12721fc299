"""Third-party odometry as an estimate: place and velocity from it, tilt and rates from the IMU.

    v = R^T v_world

R is the IMU's orientation, turned about the vertical to the heading of the fix.
"""

from collections.abc import Sequence

import numpy as np

from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import WAIST, Legs
from spikeport.robot.estimator.start import start
from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState


class Odometer:
    """Estimator that returns the place and velocity of the latest fix."""

    def __init__(self) -> None:
        # Made here, as a reset must be fast: a robot is damped if its first command is 40 ms late.
        self._legs = Legs()

    def reset(self, sensors: Sensors, fix: Fix | None = None) -> RobotState:
        """Start over; see `StateEstimator.reset`."""
        soles = self._legs.soles(sensors.q)
        begun = start(sensors, soles.points, self._legs.radii_m, fix)
        self._place, self._velocity, self._turn_rad = begun.position, np.zeros(3), 0.0
        return self.update(sensors, fix)

    def update(
        self, sensors: Sensors, fix: Fix | None = None, between: Sequence[Sensors] = ()
    ) -> RobotState:
        """Return the motion at an observation, by a fix if there is one."""
        waist_rad, waist_rad_s = sensors.q.item(WAIST), sensors.dq.item(WAIST)
        own = torso.pelvis_rotation(torso.rotation(sensors.quaternion), waist_rad)
        if fix is not None:
            self._place = np.array(fix.position, dtype=float)
            if fix.velocity is not None:
                self._velocity = np.array(fix.velocity, dtype=float)
            if fix.yaw_rad is not None:
                # The IMU's heading drifts and begins anywhere: the fix says by how much to turn it.
                self._turn_rad = fix.yaw_rad - torso.heading_rad(own)
        rotation = torso.turned(own, self._turn_rad)
        return RobotState(
            base_position=self._place.copy(),
            base_quaternion=torso.quaternion(rotation),
            base_linear_velocity=rotation.T @ self._velocity,
            base_angular_velocity=torso.pelvis_angular_velocity(
                sensors.gyroscope, waist_rad, waist_rad_s
            ),
            q=sensors.q.copy(),
            dq=sensors.dq.copy(),
        )

    @property
    def place_deviation_m(self) -> float | None:
        """None: fixes do not say how far they are off."""
        return None
