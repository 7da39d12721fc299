from dataclasses import replace

import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

from spikeport.networks.walking_policy import load
from spikeport.robot.description import JOINTS
from spikeport.training import evaluate, selection, walk
from spikeport.training.card import card
from spikeport.training.curriculum import STAGES
from spikeport.training.evaluate import Evaluation
from spikeport.training.hidden_noise import HiddenNoise
from spikeport.training.learner import LearnerOptions
from spikeport.training.train import TrainOptions
from spikeport.training.walk import train_walk

WALKS = Evaluation(100, 2, 0.0512, 0.0987, 0.1043, 2.613, 0.207)


def test_a_run_leaves_a_policy_and_its_card(tmp_path, monkeypatch):
    monkeypatch.setattr(evaluate, "EPISODE_STEPS", 3)
    for module in (selection, walk):
        monkeypatch.setattr(module, "EPISODES", 2)
    options = TrainOptions(
        tmp_path,
        steps=64,
        learner=LearnerOptions(robots=8, horizon=4),
        updates_per_segment=1,
        stages=STAGES[:1],
        evaluate_every=1,
        episodes=2,
        workers=1,
    )
    evaluations = train_walk(options, "spikeport train walk", lambda _what, _share: None)
    assert {robots: e.episodes for robots, e in evaluations.items()} == {
        "as trained": 2,
        "jumping commands": 2,
        "hard pushes": 2,
        "exact targets": 2,
        "undisturbed": 2,
    }
    assert load(tmp_path / "h1_walk.npz").joints == JOINTS
    text = (tmp_path / "h1_walk.md").read_text()
    assert "    spikeport train walk\n" in text
    assert "| as trained | 2 |" in text


def test_the_card_states_figures_recipe_and_what_a_stage_changes():
    noise = HiddenNoise(white=0.5)
    stages = (STAGES[0], replace(STAGES[0], name="harder", first_step=9, hidden_noise=noise))
    made = {"command": "spikeport train walk", "seed": 7, "step": 1234567, "robots": 512}
    text = card("h1_walk", made, {"as trained": WALKS}, stages)
    assert "1,234,567 control steps of 512 robots" in text
    assert "| as trained | 100 | 2 | 0.051 | 0.099 | 0.104 | 2.61 | 0.21 |" in text
    assert "Seed 7.\nVersions: mujoco " in text
    assert "- **harder**: first_step 9, hidden_noise.white 0.5\n" in text
    assert "weights.fall -200.0" in text
