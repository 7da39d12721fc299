import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

from spikeport.errors import UsageError
from spikeport.training import checkpoint
from spikeport.training.curriculum import STAGES
from spikeport.training.learner import LearnerOptions
from spikeport.training.selection import SHORTLIST, shortlist
from spikeport.training.train import TrainOptions


def entry(segment, fallen=0, vx=0.05, wz=0.05, stage="last"):
    errors = {"fallen": fallen, "vx_error_m_s": vx, "wz_error_rad_s": wz}
    return {"segment": segment, "stage": stage, "episodes": 100, **errors}


@pytest.fixture
def chosen(tmp_path):
    """Return a function that gives the shortlist of a log; ``gone`` checkpoints are deleted."""

    def find(*log, gone=(), every=1, segments=99):
        for each in log:
            path = checkpoint.path_of(tmp_path, each["segment"])
            path.parent.mkdir(exist_ok=True)
            path.touch()
        for segment in gone:
            checkpoint.path_of(tmp_path, segment).unlink()
        options = TrainOptions(
            tmp_path,
            steps=segments * 32,
            learner=LearnerOptions(robots=8, horizon=4),
            updates_per_segment=1,
            stages=STAGES[:1],
            evaluate_every=every,
        )
        return [each["segment"] for each in shortlist(options, list(log))]

    return find


def test_falls_and_errors_count_against_their_goals(chosen):
    log = [
        entry(1, fallen=10, vx=0.01, wz=0.01),  # 1 + 0.2 + 0.1
        entry(2, vx=0.05, wz=0.02),  # 1.2
        entry(3, fallen=1, vx=0.025, wz=0.05),  # 0.1 + 0.5 + 0.5
        entry(4, fallen=2, vx=0.025, wz=0.08),  # 0.2 + 0.5 + 0.8
    ]
    assert chosen(*log) == [3, 2, 1, 4]


def test_the_shortlist_holds_no_more_checkpoints_than_its_size(chosen):
    assert chosen(*(entry(n, fallen=n) for n in range(1, SHORTLIST + 2))) == list(
        range(1, SHORTLIST + 1)
    )


def test_only_evaluated_checkpoints_are_candidates(chosen):
    assert chosen(entry(1, fallen=3), {"segment": 2}, entry(3, fallen=9)) == [1, 3]


def test_only_checkpoints_of_the_last_stage_are_candidates(chosen):
    assert chosen(entry(1, stage="easy"), entry(2, fallen=3), entry(3, fallen=2)) == [3, 2]


def test_the_evaluation_at_the_former_end_of_a_run_that_went_on_is_no_candidate(chosen):
    log = [entry(4, fallen=2), entry(6), entry(8, fallen=1)]
    assert chosen(*log, every=4, segments=8) == [8, 4]
    assert chosen(*log[:2], every=4, segments=6) == [6, 4]


def test_deleted_checkpoints_are_no_candidates(chosen):
    assert chosen(entry(1), entry(2, fallen=3), entry(3, fallen=2), gone=(1,)) == [3, 2]


def test_a_log_whose_evaluated_checkpoints_are_deleted_is_refused(chosen, tmp_path):
    with pytest.raises(UsageError) as error:
        chosen(entry(1), {"segment": 2, "stage": "last"}, gone=(1,))
    assert str(error.value) == (
        f"no evaluated checkpoint is left in {tmp_path}/checkpoints; cure: another --out"
    )


def test_a_log_without_an_evaluation_is_refused(chosen):
    with pytest.raises(UsageError) as error:
        chosen({"segment": 1}, {"segment": 2, "stage": "last"})
    assert str(error.value) == "no checkpoint was evaluated; train longer with --steps"
