import dataclasses
import os

import pytest

from spikeport.commands.options import Target, Workers, check_seconds, check_whole_steps
from spikeport.errors import UsageError


def test_a_group_cannot_be_changed_nor_made_by_position():
    with pytest.raises(TypeError):
        Target("native", "loihi")
    with pytest.raises(dataclasses.FrozenInstanceError):
        Target().chip = "loihi2"


def test_a_sweep_has_a_process_for_each_core_it_may_use_unless_a_number_is_given(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: {1, 3})
    assert Workers().n_processes == 2
    assert Workers(n=3).n_processes == 3


@pytest.mark.parametrize("seconds", [0.0, 0.0009, 2_000_001.0, float("nan")])
def test_a_run_of_less_than_a_step_or_of_too_many_is_refused(seconds):
    check_seconds("--loss", 0.001)
    check_seconds("--loss", 1_000_000.0)
    with pytest.raises(UsageError, match="a run is at least one step of"):
        check_seconds("--loss", seconds)


def test_a_run_is_a_whole_number_of_steps():
    for seconds in (0.3, 0.007, 1.1, 999_999.999):  # 0.3 / 0.001 is 299.99999999999994
        check_seconds("--loss", seconds)
    with pytest.raises(UsageError) as caught:
        check_seconds("--loss", 0.0501)
    assert str(caught.value) == (
        "--loss 0.0501: must be a whole number of steps of 0.001 s; cure: 0.05"
    )
    with pytest.raises(UsageError, match=r"steps of 0\.005 s; cure: 4\.195$"):
        check_whole_steps("--seconds", 4.197, 0.005)
