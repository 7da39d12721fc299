"""Odometry that a robot publishes: a simulated odometer, and odometry as fixes of an estimator.

A published place counts from wherever its odometer began. Fixes count from the start of the run,
as an estimate without fixes does.
"""

import math
from dataclasses import dataclass

import numpy as np

from spikeport.errors import RobotLostError, UsageError
from spikeport.robot.estimator import torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.legs import WAIST, Legs
from spikeport.robot.estimator.start import start
from spikeport.robot.link.codec import Base
from spikeport.robot.signals import Sensors

UNTURNED = (
    "odometry without an orientation: the angle between its world and the robot's heading is "
    "unknown; cure: publish the pelvis' orientation, or at least its heading, in "
    "imu_state.quaternion, or give --estimator ekf"
)
"""The reason why a run with such odometry is refused."""


@dataclass(frozen=True)
class OdometerErrors:
    """Errors of a simulated odometer.

    Attributes
    ----------
    place_m, velocity_m_s : float
        Standard deviations of white noise, for each axis.
    drift_m, turn_rad : float
        Standard deviations of random walks, of the place along x and y and of the heading, after
        one second; they grow with the square root of time.
    """

    place_m: float = 0.005
    velocity_m_s: float = 0.02
    drift_m: float = 0.01
    turn_rad: float = 0.002

    def __post_init__(self) -> None:
        """Check the values; raise UsageError for the first wrong one."""
        for name, value in vars(self).items():
            if not 0 <= value < math.inf:
                raise UsageError(f"--odometer-error {name}={value:g}: must be 0 or more")


class SimulatedOdometer:
    """An odometer with errors, which are drawn once a step.

    Parameters
    ----------
    errors : OdometerErrors
        The errors of the odometer.
    seed : int
        Seed of the errors.
    step_s : float
        Length of a step.
    """

    def __init__(self, errors: OdometerErrors, seed: int, step_s: float) -> None:
        self._errors, self._rng = errors, np.random.default_rng(seed)
        # A random walk grows with the square root of time.
        self._root_s = float(np.sqrt(step_s))
        self._drift_m, self._turn_rad = np.zeros(3), 0.0

    def read(self, true: Base) -> Base:
        """Return the odometry of a motion: turned and moved by the drift, and with noise."""
        errors, rng = self._errors, self._rng
        self._drift_m[:2] += errors.drift_m * self._root_s * rng.standard_normal(2)
        self._turn_rad += errors.turn_rad * self._root_s * float(rng.standard_normal())
        turn = torso.rotation_z(self._turn_rad)
        place = turn @ true.position + self._drift_m + errors.place_m * rng.standard_normal(3)
        velocity = turn @ true.velocity + errors.velocity_m_s * rng.standard_normal(3)
        rotation = torso.turned(torso.rotation(true.quaternion), self._turn_rad)
        return Base(true.tick, place, velocity, torso.quaternion(rotation))


class OdometryFixes:
    """Fixes from published odometry, in a world that begins at the first one.

    The robot is then above the origin, its lowest sole at height 0, with the heading of its IMU.
    """

    _turn_rad: float
    _turn: np.ndarray
    _origin: np.ndarray
    _begun: np.ndarray

    def __init__(self) -> None:
        # Made before the first odometry: a robot is damped if its first command is 40 ms late.
        self._legs = Legs()
        self._last: Base | None = None

    def fix(self, odometry: Base, sensors: Sensors) -> Fix | None:
        """Return the fix of an odometry, without a heading if it has no orientation.

        It is None if the odometry is still the last one, which is not a new measurement.

        Parameters
        ----------
        odometry : Base
            The odometry.
        sensors : Sensors
            The observation at that time.

        Raises
        ------
        RobotLostError
            If the first odometry has no orientation.
        """
        # Compared by identity, as some publishers set no stamp.
        if odometry is self._last:
            return None
        if self._last is None:
            self._begin(odometry, sensors)
        self._last = odometry
        yaw_rad = _yaw_rad(odometry)
        return Fix(
            self._turn @ (odometry.position - self._origin) + self._begun,
            None if yaw_rad is None else yaw_rad + self._turn_rad,
            self._turn @ odometry.velocity,
        )

    def _begin(self, first: Base, sensors: Sensors) -> None:
        """Put the robot above the origin, and turn the world of the odometry to its heading."""
        begun = start(sensors, self._legs.soles(sensors.q).points, self._legs.radii_m, None)
        own = torso.pelvis_rotation(begun.rotation, sensors.q.item(WAIST))
        yaw_rad = _yaw_rad(first)
        if yaw_rad is None:
            raise RobotLostError(UNTURNED)
        self._turn_rad = torso.heading_rad(own) - yaw_rad
        self._turn = torso.rotation_z(self._turn_rad)
        self._origin, self._begun = first.position, begun.position


def _yaw_rad(odometry: Base) -> float | None:
    if not odometry.has_orientation:
        return None
    return torso.heading_rad(torso.rotation(odometry.quaternion))
