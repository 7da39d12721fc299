"""Observations of policy and critic, for a batch of robots."""

from dataclasses import replace

import numpy as np
import pytest

from spikeport.robot.walk_interface import PARTS, POSE_RAD
from spikeport.training import observation
from spikeport.training.environment import TrainingTask, WalkEnvironment
from spikeport.training.randomisation import UNDISTURBED, Randomisation, observation_noise
from spikeport.training.velocity_belief import EstimatorErrors


@pytest.fixture
def make():
    made = []

    def environment(randomisation):
        task = replace(TrainingTask(), randomisation=randomisation)
        made.append(WalkEnvironment(3, task, 0, threads=1))
        made[-1].step(0.1 * np.ones((3, 19)))
        return made[-1]

    yield environment
    for env in made:
        env.close()


def test_parts_lie_where_the_interface_has_them(make):
    env = make(UNDISTURBED)
    seen = observation.exact_observation(env, env.motion)
    assert seen.shape == (3, 69)
    np.testing.assert_array_equal(seen[:, PARTS["linear velocity"]], env.motion.velocity)
    np.testing.assert_array_equal(seen[:, PARTS["command"]], env.commands.value)
    np.testing.assert_array_equal(seen[:, PARTS["joint angles"]], env.motion.q - POSE_RAD)
    np.testing.assert_array_equal(seen[:, PARTS["last action"]], np.full((3, 19), 0.1))


def test_noise_is_within_its_width_and_absent_for_undisturbed_robots(make):
    rng = np.random.default_rng(0)
    calm, noisy = make(UNDISTURBED), make(Randomisation(observation_noise=2.0))
    assert np.array_equal(
        observation.noisy(calm, rng), observation.exact_observation(calm, calm.motion)
    )
    off = np.abs(observation.noisy(noisy, rng) - observation.exact_observation(noisy, noisy.motion))
    assert (off <= 2 * observation_noise() + 1e-12).all()
    assert off.max() > 0.5


def test_the_critic_observes_the_exact_observation_of_the_policy_and_more(make):
    env = make(UNDISTURBED)
    seen = observation.privileged(env)
    assert np.array_equal(seen[:, :69], observation.exact_observation(env, env.motion))
    assert seen.shape == (3, len(observation.PRIVILEGED.sign))


def test_only_the_policy_observes_late_and_with_the_error_of_its_estimator(make):
    late = replace(UNDISTURBED, observation_delay_steps=(4, 4))
    env = make(replace(late, estimator=EstimatorErrors(scale=0.5)))
    before, action = env.motion, env.actions[0]
    env.step(action)
    observed = observation.noisy(env, np.random.default_rng(0))
    np.testing.assert_array_equal(observed[:, PARTS["joint angles"]], before.q - POSE_RAD)
    estimate = env.belief.estimate(before.velocity, np.ones(3))
    assert np.abs(estimate - before.velocity).max() > 1e-3
    np.testing.assert_array_equal(observed[:, PARTS["linear velocity"]], estimate)
    exact = observation.privileged(env)
    np.testing.assert_array_equal(exact[:, PARTS["joint angles"]], env.motion.q - POSE_RAD)
    np.testing.assert_array_equal(exact[:, PARTS["linear velocity"]], env.motion.velocity)


def test_velocities_of_feet_are_in_the_frame_of_the_heading(make):
    env = make(UNDISTURBED)
    c, s = np.cos(env.motion.heading_rad), np.sin(env.motion.heading_rad)
    assert np.ptp(env.motion.heading_rad) > 0.5
    # 2 m/s ahead, 1 m/s to the left, 3 m/s upwards
    velocity = np.stack((2 * c - s, 2 * s + c, np.full(3, 3.0)), axis=1)
    env.feet = replace(env.feet, point_velocity=np.tile(velocity[:, None, None], (1, 2, 2, 1)))
    moving = observation.privileged(env)
    env.feet = replace(env.feet, point_velocity=np.zeros((3, 2, 2, 3)))
    difference = moving - observation.privileged(env)
    changed = difference[:, difference.any(axis=0)]
    np.testing.assert_allclose(changed, np.tile([2.0, 1.0, 3.0], (3, 2)))
