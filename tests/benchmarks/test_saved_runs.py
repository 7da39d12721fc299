"""Results of trials, which are saved and not repeated."""

import json
from dataclasses import replace
from types import SimpleNamespace

import pytest
import saved_runs

from spikeport import atomic
from spikeport.networks.walking_policy import load


class Rig:
    """Rig that records its trials and counts how often it is closed."""

    def __init__(self):
        self.performed, self.closed = [], 0
        self.sim = SimpleNamespace(close=self.close)

    def close(self):
        self.closed += 1


def results(folder, keys):
    """Return the results of some trials, and the rigs that were prepared."""
    rigs = []

    def prepare(_trial):
        rigs.append(Rig())
        return rigs[-1]

    def perform(trial, rig):
        rig.performed.append(trial)
        return {"value": 2 * trial}

    trials = {key: 10 + key for key in keys}
    found = list(saved_runs.saved_results(folder, "name", trials, prepare, perform))
    return found, rigs


def test_trials_share_a_rig_and_their_results_are_saved(tmp_path):
    found, (rig,) = results(tmp_path / "new", [1, 2])
    assert found == [{"value": 22}, {"value": 24}]
    assert (rig.performed, rig.closed) == ([11, 12], 1)
    assert json.loads((tmp_path / "new" / "name-2.json").read_text()) == {"value": 24}


def test_a_rig_is_closed_if_a_trial_fails(tmp_path):
    rig = Rig()

    def fails(_trial, _rig):
        raise RuntimeError("fell")

    with pytest.raises(RuntimeError, match="fell"):
        list(saved_runs.saved_results(tmp_path, "name", {1: 11}, lambda _: rig, fails))
    assert rig.closed == 1


def test_policies_of_other_gains_have_other_names():
    policy = load()
    other = replace(policy, gains=replace(policy.gains, kp_heading=3.0))
    assert saved_runs.policy_key(policy) == saved_runs.policy_key(load())
    assert saved_runs.policy_key(policy) != saved_runs.policy_key(other)


def test_a_trial_with_a_saved_result_is_not_repeated(tmp_path):
    results(tmp_path, [1])
    found, (rig,) = results(tmp_path, [1, 2])
    assert found == [{"value": 22}, {"value": 24}]
    assert rig.performed == [12]
    assert results(tmp_path, [1, 2])[1] == []


def test_a_trial_whose_result_was_not_written_completely_is_repeated(tmp_path, monkeypatch):
    def cut(_descriptor):
        raise OSError("power cut")

    monkeypatch.setattr(atomic.os, "fsync", cut)
    with pytest.raises(OSError, match=r"name-1\.json"):
        results(tmp_path, [1])
    monkeypatch.undo()
    assert results(tmp_path, [1])[0] == [{"value": 22}]


def test_the_clock_gives_simulated_over_cpu_time():
    clock = saved_runs.Clock(share=[0.0, 0.5], cpu_s=[1.0, 3.0])
    clock("compiling", None)
    assert clock.factor(8.0) == 2.0
