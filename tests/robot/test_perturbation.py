"""Perturbations: checks of their values, and the one that changes nothing."""

from dataclasses import dataclass

import pytest

from spikeport.errors import UsageError
from spikeport.robot.perturbation import _BOUNDS, NONE, Perturbation


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


@pytest.mark.parametrize(("name", "bounds"), _BOUNDS.items())
def test_bounds_themselves_are_allowed(name, bounds):
    low, high, _ = bounds
    for value in (low, high):
        assert getattr(Perturbation(**{name: value}), name) == value


def test_an_unknown_terrain_is_refused():
    with pytest.raises(UsageError, match="terrain=moon: unknown terrain; expected flat"):
        Perturbation(terrain="moon")


def test_the_perturbation_none_leaves_the_robot_as_it_is():
    scales = ("friction", "mass", "gains", "strength")
    assert all(getattr(NONE, name) == 1.0 for name in scales)
    rest = _BOUNDS.keys() - {*scales, "push_every"}
    assert all(getattr(NONE, name) == 0.0 for name in rest)


@dataclass(frozen=True, kw_only=True)
class Settings(Perturbation):
    n_neurons: int = 4


def test_settings_with_more_fields_have_a_perturbation_without_them():
    settings = Settings(push=0.5, terrain="slope:6", n_neurons=20)
    assert type(settings.perturbation) is Perturbation
    assert settings.perturbation == Perturbation(push=0.5, terrain="slope:6")


def test_the_perturbation_of_a_perturbation_is_equal_to_it():
    assert Perturbation(push=0.5).perturbation == Perturbation(push=0.5)
    assert NONE.perturbation == NONE
