"""Perturbations: their values are checked, and a robot without one is the robot as it is."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.perturbation import NONE, Perturbation


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"friction": 0.0}, "friction=0: must be from 0.01 to 10"),
        ({"push": float("nan")}, "push=nan: must be from 0 to 10 m/s"),
        (
            {"observation_delay": 0.007},
            "observation_delay=0.007: a delay must be a whole number of the physics' steps of "
            "0.005 s; the nearest is 0.005",
        ),
        ({"robot_model": "h2"}, "unknown robot_model 'h2'; choose from: menagerie, own, urdf"),
        ({"estimator": "gps"}, "unknown estimator 'gps'; choose from: ekf, leg-odometry, truth"),
    ],
)
def test_a_value_that_is_out_of_bounds_is_refused(values, message):
    with pytest.raises(UsageError) as caught:
        Perturbation(**values)
    assert str(caught.value) == message


def test_settings_with_more_fields_have_their_perturbation_alone():
    assert Perturbation(push=0.5).perturbation == Perturbation(push=0.5)
    assert NONE.perturbation == NONE
