"""The forward command of a policy that walks slower than it is asked to."""

import numpy as np
import pytest

pytest.importorskip("torch")

from spikeport.networks.walking_policy import load
from spikeport.robot.walk_interface import OBSERVATION_SIZE
from spikeport.training import pace
from spikeport.training.pace import FORWARD, at_asked_speeds, mean_speed_m_s, scaled


def test_a_scaled_policy_acts_as_on_a_larger_command():
    observation = np.random.RandomState(0).standard_normal(OBSERVATION_SIZE)
    larger = observation.copy()
    larger[FORWARD] *= 1.2
    np.testing.assert_allclose(scaled(load(), 1.2)(observation), load()(larger))


def test_forward_commands_are_scaled_up_by_the_speed_that_robots_lack(monkeypatch):
    monkeypatch.setattr(pace, "mean_speed_m_s", lambda _policy, asked_m_s: 0.8 * asked_m_s)
    paced = at_asked_speeds(load())
    assert paced.factor == pytest.approx(1.25)
    found, before = (policy.weights[0] for policy in (paced.policy, load()))
    np.testing.assert_allclose(found[:, FORWARD], 1.25 * before[:, FORWARD])
    found[:, FORWARD] = before[:, FORWARD]
    np.testing.assert_array_equal(found, before)


@pytest.mark.parametrize("speed_m_s", [-0.1, 0.0, 0.1])
def test_a_policy_that_hardly_walks_is_left_as_it_is(monkeypatch, speed_m_s):
    monkeypatch.setattr(pace, "mean_speed_m_s", lambda _policy, _asked_m_s: speed_m_s)
    policy = load()
    assert at_asked_speeds(policy) == (policy, None)


@pytest.mark.slow
def test_the_shipped_policy_walks_as_fast_as_it_is_asked_to():
    assert mean_speed_m_s(load(), 0.5) == pytest.approx(0.5, abs=0.03)
