import dataclasses
import os

import nengo
import numpy as np
import pytest

from spikeport.cache import FOLDER, OFF
from spikeport.commands.options import Target, Workers
from spikeport.experiments.arm.reach import ReachTrial


def test_a_group_cannot_be_changed_nor_made_by_position():
    with pytest.raises(TypeError):
        Target("native", "loihi")
    with pytest.raises(dataclasses.FrozenInstanceError):
        Target().chip = "loihi2"


def test_a_sweep_has_a_process_for_each_core_it_may_use_unless_a_number_is_given(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: {1, 3})
    assert Workers().n_processes == 2
    assert Workers(n=3).n_processes == 3


def test_a_command_keeps_results_in_the_cache_but_not_with_no_cache(
    spikeport, tmp_path, monkeypatch
):
    def network(trial):
        trial.options.cache.kept("arm", 1, lambda: {"weights": np.ones(3)})
        with nengo.Network(seed=1) as net:
            nengo.Connection(nengo.Node([0.5]), nengo.Ensemble(10, 1))
        return net

    monkeypatch.setattr(ReachTrial, "network", network)
    folder = tmp_path / "kept"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv(FOLDER, str(folder))
    assert spikeport("compile", "arm", "--no-cache").code == 0
    assert os.environ[FOLDER] == OFF
    assert list(folder.iterdir()) == []
    monkeypatch.setenv(FOLDER, str(folder))
    assert spikeport("compile", "arm").code == 0
    assert len(list(folder.iterdir())) == 1
