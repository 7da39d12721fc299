import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

import imitated_policy
import numpy as np

from spikeport.networks.walking_policy import load


@pytest.fixture
def made(monkeypatch, capsys):
    """Return a policy that a few robots taught for some steps, and the errors that were printed."""
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


def test_it_comes_nearer_to_the_shipped_policy(made):
    _, (*rounds, last) = made
    assert len(rounds) == 2
    assert last < 0.5 * min(rounds)


def test_it_is_of_the_shipped_policys_shape_and_leaves_the_same_joints_alone(made):
    policy, shipped = made[0], load()
    assert [W.shape for W in policy.weights] == [W.shape for W in shipped.weights]
    unused = ~shipped.weights[-1].any(axis=1)
    assert unused.any()
    assert not np.any(policy(np.random.RandomState(0).randn(3, 69))[:, unused])
