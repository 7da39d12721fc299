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


def test_joints_that_a_stage_holds_stay_where_they_are():
    learner = Learner(LearnerOptions(robots=2, horizon=2))
    learner.actor.e.data.fill_(1.0)
    learner.begin(Stage("holding", 0, held=("torso", "left_elbow")))
    learner.average.update_parameters(learner.actor)
    policy = learner.policy()
    held = [policy.joints.index("torso"), policy.joints.index("left_elbow")]
    assert not policy.weights[-1][held].any()
    assert not policy.biases[-1][held].any()
    assert np.delete(policy.weights[-1], held, axis=0).any(axis=1).all()
