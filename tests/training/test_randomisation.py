"""Differences from one training robot to the next."""

from dataclasses import replace

import numpy as np
import pytest

from spikeport.robot.description import KD, KP
from spikeport.robot.walk_interface import PARTS
from spikeport.training import model
from spikeport.training.randomisation import (
    UNDISTURBED,
    Bodies,
    Randomisation,
    observation_noise,
)


@pytest.fixture(scope="module")
def nominal():
    return model.build_model()


def drawn(nominal, ranges, seed=0):
    other = model.build_model()
    Bodies(nominal).draw(other, ranges, np.random.default_rng(seed))
    return other


def test_undisturbed_ranges_leave_the_robot_unchanged(nominal):
    other = drawn(nominal, UNDISTURBED)
    for name in (
        "dof_armature",
        "dof_damping",
        "body_mass",
        "body_inertia",
        "body_ipos",
        "actuator_gainprm",
    ):
        assert np.array_equal(getattr(other, name), getattr(nominal, name)), name
    assert np.array_equal(other.actuator_biasprm, nominal.actuator_biasprm)


def test_draws_are_within_their_ranges_and_lengths_stay(nominal):
    ranges = Randomisation()
    floors, torso = model.floor_pairs(nominal), nominal.body("torso_link").id
    for seed in range(20):
        other = drawn(nominal, ranges, seed)
        sliding = other.pair_friction[floors, :2]
        assert np.ptp(sliding) == 0
        assert 0.5 <= sliding[0, 0] <= 1.2
        assert np.array_equal(other.pair_friction[floors, 2:], nominal.pair_friction[floors, 2:])
        scale = other.dof_armature[6:] / nominal.dof_armature[6:]
        assert np.ptp(scale) < 1e-9
        assert 0.3 <= scale[0] <= 1.1
        kp, kd = other.actuator_gainprm[:, 0], -other.actuator_biasprm[:, 2]
        for gain in (kp / KP, kd / KD):
            assert 0.9 <= gain.min() < gain.max() <= 1.1
        assert np.array_equal(other.actuator_biasprm[:, 1], -kp)
        assert abs(other.body_mass[torso] - nominal.body_mass[torso]) <= 2.0
        assert np.abs(other.body_ipos[torso] - nominal.body_ipos[torso]).max() <= 0.02
        assert np.array_equal(other.body_pos, nominal.body_pos)


def test_draws_begin_from_the_unchanged_robot(nominal):
    """A model that is drawn again and again does not wander off."""
    heavier = replace(UNDISTURBED, torso_mass_kg=2.0)
    bodies, rng, other = Bodies(nominal), np.random.default_rng(0), model.build_model()
    torso = nominal.body("torso_link").id
    for _ in range(50):
        bodies.draw(other, heavier, rng)
        assert abs(other.body_mass[torso] - nominal.body_mass[torso]) <= 2.0


def test_the_last_action_has_no_noise_and_the_command_little():
    width = observation_noise()
    assert not width[PARTS["last action"]].any()
    assert set(width[PARTS["joint velocities"]]) == {0.5}
    assert set(width[PARTS["command"]]) == {0.05}


def test_all_masses_may_be_scaled_together(nominal):
    other = drawn(nominal, replace(UNDISTURBED, mass=(1.1, 1.1)))
    np.testing.assert_allclose(other.body_mass, 1.1 * nominal.body_mass)
    np.testing.assert_allclose(other.body_inertia, 1.1 * nominal.body_inertia)
