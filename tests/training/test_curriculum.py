"""Stages of training follow each other."""

from spikeport.training.curriculum import STAGES, stage_at


def test_stages_follow_each_other():
    firsts = [stage.first_step for stage in STAGES]
    assert firsts == sorted(firsts)
    assert stage_at(0) is STAGES[0]
    assert stage_at(firsts[1] - 1) is STAGES[0]
    assert stage_at(firsts[1]) is STAGES[1]
    assert stage_at(10**9) is STAGES[-1]
