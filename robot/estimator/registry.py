"""The estimators by name."""

from collections.abc import Callable

from spikeport.errors import unknown
from spikeport.robot.estimator.base import StateEstimator
from spikeport.robot.estimator.contact_aided_ekf import ContactAidedEkf
from spikeport.robot.estimator.leg_odometry import LegOdometry
from spikeport.robot.estimator.odometer import Odometer

TRUTH, LEG_ODOMETRY, EKF = "truth", "leg-odometry", "ekf"
ODOMETER, EKF_ODOMETER = "odometer", "ekf+odometer"
BY_SENSORS: dict[str, Callable[[], StateEstimator]] = {
    LEG_ODOMETRY: LegOdometry,
    EKF: ContactAidedEkf,
    ODOMETER: Odometer,
    EKF_ODOMETER: ContactAidedEkf,
}
ESTIMATORS = (TRUTH, *BY_SENSORS)
"""Names of the estimators; `TRUTH` is for simulations alone."""
BY_ODOMETRY = (ODOMETER, EKF_ODOMETER)
"""The estimators whose fixes come from a robot's odometry."""
WITHOUT_ODOMETRY = tuple(name for name in ESTIMATORS if name not in BY_ODOMETRY)
"""The estimators that need nothing but the robot's own sensors, and the truth."""


def check_estimator(name: str) -> None:
    """Raise UsageError if an estimator is not known."""
    if name not in ESTIMATORS:
        raise unknown("estimator", name, ESTIMATORS)
