from dataclasses import replace

import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

from spikeport.networks.walking_policy import load
from spikeport.robot.description import JOINTS
from spikeport.training import evaluate, selection, settled, walk
from spikeport.training.curriculum import STAGES
from spikeport.training.learner import LearnerOptions
from spikeport.training.train import TrainOptions
from spikeport.training.walk import train_walk


@pytest.mark.slow
def test_a_run_leaves_a_policy_and_its_card(tmp_path, monkeypatch):
    monkeypatch.setattr(evaluate, "EPISODE_STEPS", 3)
    monkeypatch.setattr(settled, "SECONDS", 0.1)
    monkeypatch.setattr(settled, "SETTLED_S", 0.04)
    for module in (selection, walk):
        monkeypatch.setattr(module, "EPISODES", 2)
    options = TrainOptions(
        tmp_path,
        steps=64,
        learner=LearnerOptions(robots=8, horizon=4),
        updates_per_segment=1,
        # Two segments of 32 steps: none begins in the second stage.
        stages=(STAGES[0], replace(STAGES[1], first_step=40)),
        evaluate_every=1,
        episodes=2,
        workers=1,
    )
    evaluations = train_walk(options, "spikeport train walk", lambda _what, _share: None)
    assert {robots: e.episodes for robots, e in evaluations.items()} == {
        "as trained": 2,
        "jumping commands": 2,
        "exact targets": 2,
        "undisturbed": 2,
    }
    assert load(tmp_path / "h1_walk.npz").joints == JOINTS
    text = (tmp_path / "h1_walk.md").read_text()
    assert "    spikeport train walk\n" in text
    assert "| as trained | 2 |" in text
    assert "- **step**: " in text
    assert "- **stride**: " not in text
