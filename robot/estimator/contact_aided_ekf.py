"""The contact-aided invariant extended Kalman filter: IMU, joints and feet that stand still.

Source: Hartley et al. 2020, see `group`; `propagation` and `footholds` have its equations.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spikeport.robot.estimator import footholds, legs, torso
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.belief import (
    ACCELEROMETER_BIAS,
    GYROSCOPE_BIAS,
    N_ERRORS,
    N_VECTORS,
    PLACE,
    ROTATION,
    VELOCITY,
    Belief,
    corrected,
    errors_of,
)
from spikeport.robot.estimator.contacts import ContactDetector, ContactLimits
from spikeport.robot.estimator.external_fix import FixNoise, displaced, fixed
from spikeport.robot.estimator.footholds import Points
from spikeport.robot.estimator.group import Pose, hat
from spikeport.robot.estimator.legs import WAIST, Legs, Soles
from spikeport.robot.estimator.propagation import ImuNoise, propagated
from spikeport.robot.estimator.start import start
from spikeport.robot.estimator.torso import IMU_OFFSET_M
from spikeport.robot.feet import POINTS
from spikeport.robot.signals import Sensors
from spikeport.robot.state import RobotState


@dataclass(frozen=True)
class EkfNoise:
    """The noise of sensors and contacts that the filter assumes.

    Attributes
    ----------
    imu : ImuNoise
        Densities of the IMU's noise, and of slip.
    joint_rad : float
        Standard deviation of joint angles.
    sole_m : float
        Standard deviation of a sole's point from its place by the joints: soles and floor yield.
    floor_m : float or None
        Standard deviation of the floor's height where a foot lands; None if it need not be level.
    fix : FixNoise
        The noise of a fix from outside.
    contact : ContactLimits
        The limits by which a point counts as standing.
    tilt_rad, velocity_m_s, gyroscope_bias, accelerometer_bias : float
        Standard deviations at a reset; biases in rad/s and m/s^2.
    """

    imu: ImuNoise = field(default_factory=ImuNoise)
    joint_rad: float = 0.001
    sole_m: float = 0.001
    floor_m: float | None = 0.05
    fix: FixNoise = field(default_factory=FixNoise)
    contact: ContactLimits = field(default_factory=ContactLimits)
    tilt_rad: float = 0.02
    velocity_m_s: float = 0.1
    gyroscope_bias: float = 0.01
    accelerometer_bias: float = 0.1


DEFAULT = EkfNoise()


class ContactAidedEkf:
    """Estimator of motion by IMU, joints and contacts of the feet; see `StateEstimator`.

    Parameters
    ----------
    noise : EkfNoise
        The noise of sensors and contacts.

    Attributes
    ----------
    belief : Belief
        State of the IMU with its uncertainty.
    standing : ndarray, (4,) of bool
        The points of ``feet.POINTS`` that stand.
    """

    belief: Belief
    standing: np.ndarray

    def __init__(self, noise: EkfNoise = DEFAULT) -> None:
        self._noise = noise
        self._legs = Legs()

    def reset(self, sensors: Sensors, fix: Fix | None = None) -> RobotState:
        """Start over at rest; see `StateEstimator.reset`."""
        noise = self._noise
        soles = self._legs.soles(sensors.q)
        rotation, place, floor_m = start(sensors, soles.points, self._legs.radii_m, fix)
        self._heights_m = self._legs.radii_m + floor_m
        vectors, deviations = np.zeros((N_VECTORS, 3)), np.zeros(N_ERRORS)
        vectors[PLACE] = place + rotation @ IMU_OFFSET_M
        # By definition, the heading is the world's or the fix's: it has no error.
        deviations[ROTATION] = noise.tilt_rad, noise.tilt_rad, 0.0
        deviations[errors_of(VELOCITY)] = noise.velocity_m_s
        deviations[GYROSCOPE_BIAS] = noise.gyroscope_bias
        deviations[ACCELEROMETER_BIAS] = noise.accelerometer_bias
        spread = np.eye(N_ERRORS)
        # The fix gives the place, whatever the error of the tilt: xi_R x o + xi_p = 0. Otherwise
        # the filter would take the next fix, far from the origin, for an observation of the tilt.
        spread[errors_of(PLACE), ROTATION] = hat(place)
        covariance = spread @ np.diag(deviations**2) @ spread.T
        self.belief = Belief(Pose(rotation, vectors), np.zeros(3), np.zeros(3), covariance)
        self._detector = ContactDetector(len(POINTS), noise.contact)
        self.standing = np.zeros(len(POINTS), dtype=bool)
        self._last = sensors
        return self._state(sensors)

    def update(
        self, sensors: Sensors, fix: Fix | None = None, between: Sequence[Sensors] = ()
    ) -> RobotState:
        """Propagate by the IMU, correct by the contacts, and by a fix if there is one."""
        dt_s = sensors.time_s - self._last.time_s
        if dt_s > 0:
            imu = _mean_imu(self._last, between, sensors)
            self.belief = propagated(self.belief, *imu, self.standing, dt_s, self._noise.imu)
            self._last = sensors
            self._correct_by_feet(sensors, dt_s)
        if fix is not None:
            waist_rad = sensors.q.item(WAIST)
            observation = fixed(self.belief, fix, waist_rad, self._noise.fix)
            self.belief = corrected(self.belief, observation)
        return self._state(sensors)

    @property
    def place_deviation_m(self) -> float | None:
        """Standard deviation of the place in the plane, by the covariance of the belief."""
        sensitivity = displaced(self.belief)[:2]
        return float(np.sqrt(np.trace(sensitivity @ self.belief.covariance @ sensitivity.T)))

    def _correct_by_feet(self, sensors: Sensors, dt_s: float) -> None:
        """Correct by points that still stand, forget points that no longer do, and add new ones."""
        soles, waist = self._legs.soles(sensors.q), torso.rotation_z(sensors.q.item(WAIST))
        up = waist @ self.belief.pose.rotation[2]
        lowest = soles.points @ up - self._legs.radii_m
        # Both points of a foot share its force.
        support = np.repeat(legs.support_n(soles, sensors.torque, up), 2)
        standing = self._detector.update(sensors.time_s, lowest, support)
        points = self._points(soles, waist)
        # A point corrects from its second step on: the first one defines where it stands.
        stayed, new = self.standing & standing, standing & ~self.standing
        self.belief = footholds.forgotten(self.belief, self.standing & ~standing)
        if stayed.any():
            rolled = self._rolling(sensors, soles, waist, dt_s) * stayed[:, None]
            self.belief = footholds.rolled(self.belief, rolled)
            observation = footholds.standing_still(self.belief, points, stayed)
            self.belief = corrected(self.belief, observation)
        self._add(points, new)
        self.standing = standing

    def _add(self, points: Points, new: np.ndarray) -> None:
        """Add contacts, and correct them by a level floor if one is assumed."""
        if not new.any():
            return
        self.belief = footholds.added(self.belief, points, new)
        if self._noise.floor_m is not None:
            deviation_m = self._noise.floor_m
            observation = footholds.level(self.belief, new, self._heights_m, deviation_m)
            self.belief = corrected(self.belief, observation)

    def _points(self, soles: Soles, waist: np.ndarray) -> Points:
        """Turn the soles' points into the IMU's frame: h = Rz(waist)^T s - r."""
        noise = self._noise
        places = soles.points @ waist
        by_waist = crossed_up(places)[:, :, None]
        jacobians = np.concatenate((waist.T @ soles.jacobians, by_waist), axis=2)
        covariances = noise.joint_rad**2 * jacobians @ jacobians.transpose(0, 2, 1)
        return Points(places - IMU_OFFSET_M, covariances + noise.sole_m**2 * np.eye(3))

    def _rolling(
        self, sensors: Sensors, soles: Soles, waist: np.ndarray, dt_s: float
    ) -> np.ndarray:
        """Return how far the contact shapes roll, (4, 3) in m: (w_foot x radius e_z) dt."""
        rotation = self.belief.pose.rotation @ waist.T
        # The bias is not subtracted: times the radius, 5 mrad/s are 0.1 mm/s, and the assumed slip
        # is 50 mm/s. With the believed bias subtracted, as in `_state`, errors differ by under 1 %.
        rate, waist_rad_s = sensors.gyroscope, sensors.dq.item(WAIST)
        pelvis = torso.pelvis_angular_velocity(rate, sensors.q.item(WAIST), waist_rad_s)
        feet = (soles.turning @ sensors.dq[: legs.LEG_JOINTS] + pelvis) @ rotation.T
        return np.asarray(crossed_up(feet) * self._legs.radii_m[:, None] * dt_s)

    def _state(self, sensors: Sensors) -> RobotState:
        """Return the pelvis' motion, see `torso`."""
        belief, waist_rad = self.belief, sensors.q.item(WAIST)
        rotation, vectors = belief.pose
        omega = sensors.gyroscope - belief.gyroscope_bias
        pelvis = torso.pelvis_rotation(rotation, waist_rad)
        velocity = vectors[VELOCITY] - rotation @ hat(omega) @ IMU_OFFSET_M
        return RobotState(
            base_position=vectors[PLACE] - rotation @ IMU_OFFSET_M,
            base_quaternion=torso.quaternion(pelvis),
            base_linear_velocity=pelvis.T @ velocity,
            base_angular_velocity=torso.pelvis_angular_velocity(
                omega, waist_rad, sensors.dq.item(WAIST)
            ),
            q=sensors.q.copy(),
            dq=sensors.dq.copy(),
        )


def crossed_up(vectors: np.ndarray) -> np.ndarray:
    """Return the cross products (n, 3) of vectors (n, 3) with the vertical."""
    x, y, _ = vectors.T
    return np.stack((y, -x, np.zeros(len(vectors))), axis=1)


def _mean_imu(
    last: Sensors, between: Sequence[Sensors], now: Sensors
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean rates (3,), by the trapezoidal rule, and the mean specific force (3,).

    The rates are exact to second order. A specific force is that of the time up to its observation,
    so that of ``last`` does not count.
    """
    n = len(between) + 1
    rates = sum((one.gyroscope for one in between), last.gyroscope / 2 + now.gyroscope / 2)
    return rates / n, np.mean([one.accelerometer for one in (*between, now)], axis=0)
