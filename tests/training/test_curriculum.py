"""The stages of training, and their order."""

from dataclasses import replace

from spikeport.training.curriculum import STAGES, stage_at, without_hidden_noise
from spikeport.training.hidden_noise import HiddenNoise


def test_stages_follow_each_other():
    firsts = [stage.first_step for stage in STAGES]
    assert firsts == sorted(firsts)
    assert stage_at(0) is STAGES[0]
    assert stage_at(firsts[1] - 1) is STAGES[0]
    assert stage_at(firsts[1]) is STAGES[1]
    assert stage_at(10**9) is STAGES[-1]


def test_stages_without_hidden_noise_are_otherwise_unchanged():
    quiet = without_hidden_noise()
    assert any(stage.hidden_noise for stage in STAGES)
    assert not any(stage.hidden_noise for stage in quiet)
    assert [replace(stage, hidden_noise=HiddenNoise()) for stage in STAGES] == list(quiet)
