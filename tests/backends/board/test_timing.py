"""Beginnings and deadlines of a chip's steps, in real and in simulated time."""

from spikeport.backends.board.timing import RealTime, SimulatedTime, StepDeadlines
from tests.helpers.fake_board import FakeClock


def begins(clock: FakeClock, deadlines: StepDeadlines, lasts_s: list[float]) -> list[float]:
    """Return the beginnings of steps of these durations, in ms after the first."""
    found = []
    for last_s in lasts_s:
        deadlines.begin()
        found.append(round(1000 * (clock.now() - 100), 3))
        clock.time_s += last_s
    return found


def test_steps_begin_at_multiples_of_the_period_whatever_they_take() -> None:
    clock = FakeClock()
    deadlines = StepDeadlines(RealTime(0.001), clock)
    assert begins(clock, deadlines, [0.0002, 0.0009, 0.0, 0.0005]) == [0, 1, 2, 3]
    assert deadlines.overruns == 0


def test_a_step_that_is_a_little_late_does_not_shift_the_next() -> None:
    clock = FakeClock()
    deadlines = StepDeadlines(RealTime(0.001), clock)
    assert begins(clock, deadlines, [0.0013, 0.0001, 0.0]) == [0, 1.3, 2]
    assert deadlines.overruns == 1


def test_after_a_stall_further_steps_are_timed_from_the_late_one() -> None:
    clock = FakeClock()
    deadlines = StepDeadlines(RealTime(0.001), clock)
    assert begins(clock, deadlines, [0.0001, 0.0504, 0.0001, 0.0001]) == [0, 1, 51.4, 52.4]
    assert deadlines.overruns == 1


def test_simulated_time_does_not_wait() -> None:
    clock = FakeClock()
    deadlines = StepDeadlines(SimulatedTime(patience_s=2.0), clock)
    assert begins(clock, deadlines, [0.5, 0.0, 0.0]) == [0, 500, 500]
    assert deadlines.begin() == clock.now() + 2.0
    assert deadlines.overruns == 0


def test_each_timing_states_after_which_time_a_board_is_given_up() -> None:
    found = [timing.limit for timing in (RealTime(0.001, 0), RealTime(0.001, 5), SimulatedTime())]
    assert found == ["1 step of 1 ms", "6 steps of 1 ms", "10 s"]
