import multiprocessing
import signal
import time
from datetime import timedelta

import pytest

pytest.importorskip("torch")
pytest.importorskip("rsl_rl")

from torch import distributed

from spikeport.errors import WorkerLostError
from spikeport.training import workers
from spikeport.training.learner import Learner, LearnerOptions
from spikeport.training.workers import ALONE, Worker, others
from tests.helpers.torch_workers import add, answer_late, die, note_mask


@pytest.mark.slow
def test_workers_sum_their_values():
    values = [1.0, 10.0]
    with others(1, add, values):
        assert add(Worker(0, 2), values) == 11.0


@pytest.mark.slow
def test_only_the_first_worker_can_be_interrupted(tmp_path):
    with others(1, note_mask, tmp_path):
        note_mask(Worker(0, 2), tmp_path)
    assert [(tmp_path / str(rank)).read_text() for rank in range(2)] == ["False", "True"]


@pytest.mark.slow
def test_a_worker_that_died_is_named_with_a_cure():
    with pytest.raises(WorkerLostError) as lost, others(1, die):
        add(Worker(0, 2), [1.0, 10.0])
    assert str(lost.value) == (
        "process 2 of 2 ended with exit code -9; finished segments are kept: give the same command "
        "again"
    )
    assert not distributed.is_initialized()


def test_a_worker_that_does_not_come_is_not_awaited_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "MEETING", timedelta(seconds=0.2))
    with pytest.raises(RuntimeError, match="timeout"):
        Worker(0, 2).join(str(tmp_path / "meeting"))
    assert not distributed.is_initialized()


@pytest.mark.slow
def test_an_answer_may_take_longer_than_the_meeting(monkeypatch):
    with monkeypatch.context() as hasty:
        hasty.setattr(workers, "ANSWER", timedelta(seconds=0.5))
        with pytest.raises(RuntimeError, match="Timed out"), others(1, answer_late):
            add(Worker(0, 2), [1.0, 10.0])
    with others(1, answer_late):
        assert add(Worker(0, 2), [1.0, 10.0]) == 11.0


class Fails:
    """A process that cannot be started."""

    def start(self):
        raise OSError("no more processes")


def test_a_process_is_ended_if_the_next_one_cannot_be_started():
    first = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(60,))
    with pytest.raises(OSError, match="no more"), workers._running([first, Fails()]):
        pytest.fail("one is missing")
    assert first.exitcode == -signal.SIGTERM


def test_a_single_worker_starts_no_process_group():
    with others(0, add, [1.0]):
        assert not distributed.is_initialized()


def test_robots_are_divided_among_the_workers():
    options = LearnerOptions(robots=8, horizon=4)
    assert [Learner(options, Worker(rank, 3)).robots for rank in range(3)] == [3, 3, 2]
    assert Learner(options, ALONE).robots == 8
