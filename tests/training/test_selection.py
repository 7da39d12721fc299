import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

from spikeport.errors import UsageError
from spikeport.training.selection import shortlist


def entry(segment, fallen=0, vx=0.05, wz=0.05, stage="last"):
    errors = {"fallen": fallen, "vx_error_m_s": vx, "wz_error_rad_s": wz}
    return {"segment": segment, "stage": stage, **errors}


def chosen(*log):
    return [e["segment"] for e in shortlist(list(log))]


def test_falls_count_before_errors_and_errors_against_their_goals():
    log = [
        entry(1, fallen=1, vx=0.01),
        entry(2, vx=0.06, wz=0.02),  # 1.2
        entry(3, vx=0.03, wz=0.05),  # 1.0
        entry(4, vx=0.03, wz=0.08),  # 1.3
    ]
    assert chosen(*log) == [3, 2, 4]


def test_only_evaluated_checkpoints_are_candidates():
    assert chosen(entry(1, fallen=3), {"segment": 2}, entry(3, fallen=9)) == [1, 3]


def test_only_the_last_stage_asks_for_all_that_is_wanted():
    assert chosen(entry(1, stage="easy"), entry(2, fallen=3), entry(3, fallen=2)) == [3, 2]


def test_without_an_evaluation_nothing_can_be_chosen():
    with pytest.raises(UsageError) as error:
        shortlist([{"segment": 1}, {"segment": 2, "stage": "last"}])
    assert str(error.value) == "no checkpoint was evaluated; train longer with --steps"
