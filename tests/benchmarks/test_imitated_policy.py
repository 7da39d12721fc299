"""A policy that imitates the shipped one."""

import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

import imitated_policy
import numpy as np

from spikeport.networks.walking_policy import load


@pytest.fixture
def made(monkeypatch, capsys):
    """Return a policy that was trained on a few robots for some steps, and the printed errors."""
    for name, value in {
        "ROBOTS": 8,
        "STEPS": 20,
        "ROUNDS": 2,
        "EPOCHS": 1,
        "LAST_EPOCHS": 60,
    }.items():
        monkeypatch.setattr(imitated_policy, name, value)
    policy = imitated_policy.imitate(load(), seed=0)
    return policy, [float(line.split()[-1]) for line in capsys.readouterr().out.splitlines()]


def test_training_brings_the_policy_nearer_to_the_shipped_one(made):
    _, (*rounds, last) = made
    assert len(rounds) == 2
    assert last < 0.5 * min(rounds)


@pytest.mark.slow
def test_the_policy_has_the_shape_and_the_unused_joints_of_the_shipped_one(made):
    policy, shipped = made[0], load()
    assert [W.shape for W in policy.weights] == [W.shape for W in shipped.weights]
    unused = ~shipped.weights[-1].any(axis=1)
    assert unused.any()
    assert not np.any(policy(np.random.RandomState(0).randn(3, 69))[:, unused])
