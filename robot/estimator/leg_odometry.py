"""Leg odometry, which assumes that the lowest points of the feet stand still.

    v = -(J dq + omega x s) weighted by how low the points s are, then through a low-pass filter

Orientation is the IMU's own. Height follows from a level floor; place is the integral of velocity.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import LEG_JOINTS, WAIST, Legs, Soles
from spikeport.robot.estimator.start import start
from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState


@dataclass(frozen=True)
class OdometryOptions:
    """The weights of points, and the filter of velocities.

    Attributes
    ----------
    lowness_m : float
        A point this far above the lowest one has 1/e of its weight.
    filter_s : float
        Time constant of the velocity's low-pass filter.
    """

    lowness_m: float = 0.004
    filter_s: float = 0.03


DEFAULT = OdometryOptions()


class LegOdometry:
    """Estimator of motion by joints, gyroscope and the IMU's orientation."""

    def __init__(self, options: OdometryOptions = DEFAULT) -> None:
        self._options = options
        self._legs = Legs()

    def reset(self, sensors: Sensors, fix: Fix | None = None) -> RobotState:
        """Start over at rest; see `StateEstimator.reset`."""
        soles = self._legs.soles(sensors.q)
        begun = start(sensors, soles.points, self._legs.radii_m, fix)
        self._position = begun.position
        own = torso.heading_rad(torso.rotation(sensors.quaternion))
        self._turn_rad = torso.heading_rad(begun.rotation) - own
        self._velocity, self._time_s = np.zeros(3), sensors.time_s
        rotation = self._pelvis(sensors)
        self._floor_m = begun.floor_m
        return self._state(sensors, rotation)

    def update(
        self, sensors: Sensors, fix: Fix | None = None, between: Sequence[Sensors] = ()
    ) -> RobotState:
        """Filter the velocity and integrate it; a fix replaces place and heading."""
        rotation, dt_s = self._pelvis(sensors), sensors.time_s - self._time_s
        if dt_s > 0:
            self._time_s = sensors.time_s
            soles = self._legs.soles(sensors.q)
            # expm1 keeps the digits of 1 - exp(-x) for steps much shorter than the time constant.
            share = -np.expm1(-dt_s / self._options.filter_s)
            measured = self._measured(sensors, soles, rotation[2])
            self._velocity = self._velocity + share * (measured - self._velocity)
            self._position = self._position + rotation @ self._velocity * dt_s
            self._position[2] = self._floor_m + self._height_m(soles, rotation)
        if fix is not None:
            rotation = self._take(fix, rotation, sensors)
        return self._state(sensors, rotation)

    @property
    def place_deviation_m(self) -> float | None:
        """None: errors from slipping feet and from the filter are not tracked."""
        return None

    def _take(self, fix: Fix, rotation: np.ndarray, sensors: Sensors) -> np.ndarray:
        """Replace the place, and a measured heading, by a fix; return the pelvis' rotation."""
        self._floor_m += fix.position[2] - self._position[2]
        self._position = np.array(fix.position, dtype=float)
        if fix.yaw_rad is not None:
            self._turn_rad += fix.yaw_rad - torso.heading_rad(rotation)
        return self._pelvis(sensors)

    def _measured(self, sensors: Sensors, soles: Soles, up: np.ndarray) -> np.ndarray:
        """Return (3,) the pelvis' velocity, in its frame, if the lowest points stand still."""
        radii_m, joints = self._legs.radii_m, sensors.dq[:LEG_JOINTS]
        omega = _angular_velocity(sensors)
        turning = soles.turning @ joints
        lowest = soles.points - radii_m[:, None] * up
        # The point that touches is a radius below the centre, so the foot's turning moves it too.
        moving = soles.jacobians @ joints - np.cross(turning, radii_m[:, None] * up)
        heights = lowest @ up
        weights = np.exp(-(heights - heights.min()) / self._options.lowness_m)
        velocities = -(moving + np.cross(omega, lowest))
        return np.asarray(weights @ velocities / weights.sum())

    def _height_m(self, soles: Soles, rotation: np.ndarray) -> float:
        """Return the height of the pelvis above its lowest sole."""
        return float(np.max(self._legs.radii_m - soles.points @ rotation[2]))

    def _pelvis(self, sensors: Sensors) -> np.ndarray:
        """Return (3, 3) the pelvis' rotation: by the IMU, turned to the heading of fixes."""
        own = torso.pelvis_rotation(torso.rotation(sensors.quaternion), sensors.q[WAIST])
        return torso.turned(own, self._turn_rad)

    def _state(self, sensors: Sensors, rotation: np.ndarray) -> RobotState:
        return RobotState(
            base_position=self._position.copy(),
            base_quaternion=torso.quaternion(rotation),
            base_linear_velocity=self._velocity.copy(),
            base_angular_velocity=_angular_velocity(sensors),
            q=sensors.q.copy(),
            dq=sensors.dq.copy(),
        )


def _angular_velocity(sensors: Sensors) -> np.ndarray:
    return torso.pelvis_angular_velocity(sensors.gyroscope, sensors.q[WAIST], sensors.dq[WAIST])
