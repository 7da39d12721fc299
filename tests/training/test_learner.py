import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

import numpy as np

from spikeport.training.curriculum import Stage
from spikeport.training.learner import AVERAGING, Learner, LearnerOptions


def test_the_policy_is_the_average_of_the_actors():
    learner = Learner(LearnerOptions(robots=2, horizon=2))
    for value in (1.0, 2.0):
        learner.actor.e.data.fill_(value)
        learner.average.update_parameters(learner.actor)
    both_sides = (learner.actor.out_sign.numpy() + 1) / 2
    expected = (AVERAGING * 1.0 + (1 - AVERAGING) * 2.0) * both_sides
    np.testing.assert_allclose(learner.policy().biases[-1], expected, rtol=1e-6)


def test_arms_that_a_stage_does_not_move_hang():
    learner = Learner(LearnerOptions(robots=2, horizon=2))
    learner.actor.e.data.fill_(1.0)
    learner.begin(Stage("hanging", 0, moves_arms=False))
    learner.average.update_parameters(learner.actor)
    policy = learner.policy()
    arms = [i for i, joint in enumerate(policy.joints) if "shoulder" in joint or "elbow" in joint]
    assert len(arms) == 8
    assert not policy.weights[-1][arms].any()
    assert not policy.biases[-1][arms].any()
    assert np.delete(policy.weights[-1], arms, axis=0).any(axis=1).all()
