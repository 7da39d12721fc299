import dataclasses
import os

import pytest

from spikeport.commands.options import Target, Workers


def test_a_group_cannot_be_changed_nor_made_by_position():
    with pytest.raises(TypeError):
        Target("native", "loihi")
    with pytest.raises(dataclasses.FrozenInstanceError):
        Target().chip = "loihi2"


def test_a_sweep_has_a_process_for_each_core_it_may_use_unless_a_number_is_given(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: {1, 3})
    assert Workers().n_processes == 2
    assert Workers(n=3).n_processes == 3
