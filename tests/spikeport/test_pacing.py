"""Pacing: deadlines of steps, the clock, times of round trips, and steps without disturbance."""

import gc
import os
import threading

import pytest

from spikeport.errors import UsageError
from spikeport.pacing import Deadlines, RoundTrips, SystemClock, undisturbed
from tests.helpers.fake_board import FakeClock


def test_a_stall_is_one_overrun_and_is_not_made_up_for_in_a_burst() -> None:
    clock = FakeClock()
    deadlines, ends = Deadlines(0.002, clock), []
    begin = clock.now()
    for lasts_s in (0.001, 0.0201, 0.001, 0.0):
        ends.append(round(1000 * (deadlines.begin() - begin), 3))
        clock.time_s += lasts_s
    assert ends == [2, 4, 24.1, 26.1]
    assert deadlines.overruns == 1


def test_a_step_after_a_wait_until_its_beginning_is_late_only_if_a_whole_step_is_missed() -> None:
    clock = FakeClock()
    deadlines = Deadlines(0.002, clock)
    for late_s, waited, overruns in ((0.0001, True, 0), (0.0001, False, 1), (0.003, True, 2)):
        clock.time_s = deadlines.begin() + late_s
        deadlines.begin(waited=waited)
        assert deadlines.overruns == overruns


def test_the_system_clock_waits_only_for_times_in_the_future() -> None:
    clock = SystemClock()
    begin = clock.now()
    clock.sleep_until(begin - 5)
    clock.sleep_until(begin + 0.002)
    assert clock.now() >= begin + 0.002


def test_quantiles_of_round_trips_are_within_two_per_cent() -> None:
    trips = RoundTrips()
    assert trips.quantile_s(0.5) is None
    for i in range(1, 1001):
        trips.add(i * 1e-5)
    assert trips.quantile_s(0.5) == pytest.approx(5e-3, rel=0.02)
    assert trips.quantile_s(0.99) == pytest.approx(9.9e-3, rel=0.02)
    assert trips.worst_s == 1e-2
    trips.add(1e9)
    assert trips.quantile_s(1.0) <= 1e9


def test_garbage_collection_skips_earlier_objects_while_undisturbed() -> None:
    with undisturbed():
        assert gc.get_freeze_count() > 1000
    assert gc.get_freeze_count() == 0


def schedule(thread: threading.Thread) -> tuple[int, int]:
    """Return the scheduling policy and the priority of a thread."""
    number = thread.native_id
    return os.sched_getscheduler(number), os.sched_getparam(number).sched_priority


def test_threads_have_the_priority_within_the_block_and_then_their_earlier_one() -> None:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(3))
    except PermissionError as error:
        pytest.skip(f"no priorities here: {error}")
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    stop = threading.Event()
    other = threading.Thread(target=stop.wait)
    other.start()
    threads = threading.current_thread(), other
    try:
        os.sched_setscheduler(other.native_id, os.SCHED_BATCH, os.sched_param(0))
        before = [*map(schedule, threads)]
        with undisturbed(3):
            assert [*map(schedule, threads)] == 2 * [(os.SCHED_FIFO, 3)]
        assert [*map(schedule, threads)] == before
        assert before[0] != before[1]
    finally:
        stop.set()
        other.join()


def test_a_priority_that_the_system_refuses_is_an_error_with_a_cure(monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with pytest.raises(UsageError, match="cure: start it with"), undisturbed(3):
        pass
    assert gc.get_freeze_count() == 0
