import pytest

from spikeport.commands.checks import check_needed, check_seconds, check_whole_steps
from spikeport.errors import UsageError
from spikeport.experiments import registry
from spikeport.experiments.options import Options


def test_a_setting_that_some_points_of_a_sweep_need_is_accepted():
    walk = registry.get("walk")
    chosen = [walk.settings(push=push, push_every=2.0) for push in (0.0, 0.5)]
    trials = [walk.trial(one, Options(1.0)) for one in chosen]
    check_needed(["push_every"], trials)
    with pytest.raises(UsageError, match="push_every: does nothing without push"):
        check_needed(["push_every"], trials[:1])


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
