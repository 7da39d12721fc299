"""The estimators by name."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.estimator.contact_aided_ekf import ContactAidedEkf
from spikeport.robot.estimator.leg_odometry import LegOdometry
from spikeport.robot.estimator.odometer import Odometer
from spikeport.robot.estimator.registry import BY_SENSORS, ESTIMATORS, check_estimator


def test_estimators_are_made_by_their_names() -> None:
    assert {name: type(make()) for name, make in BY_SENSORS.items()} == {
        "leg-odometry": LegOdometry,
        "ekf": ContactAidedEkf,
        "odometer": Odometer,
        "ekf+odometer": ContactAidedEkf,
    }


@pytest.mark.parametrize("name", ESTIMATORS)
def test_known_estimators_pass(name: str) -> None:
    check_estimator(name)


def test_an_unknown_estimator_is_refused() -> None:
    with pytest.raises(UsageError, match="unknown estimator 'gps'; choose from: ekf, "):
        check_estimator("gps")
