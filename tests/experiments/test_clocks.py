"""Time steps that do not fit each other; `test_loop` has them in a loop with simulators."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.errors import DivergedError, UsageError
from spikeport.experiments.clocks import PlantClock, SimulatorClock, controller_steps


def refusal(function, *arguments):
    with pytest.raises(UsageError) as caught:
        function(*arguments)
    return str(caught.value)


@pytest.mark.parametrize(("plant_s", "steps"), [(0.001, 1), (0.004, 4), (0.1 + 0.2, 300)])
def test_a_step_of_the_plant_takes_a_whole_number_of_the_controllers(plant_s, steps):
    assert controller_steps(plant_s, 0.001) == steps


@pytest.mark.parametrize("dt_s", [0.003, 0.01])
def test_plant_steps_that_are_no_multiple_of_the_controllers_are_refused(dt_s):
    assert refusal(controller_steps, 0.004, dt_s) == (
        f"the plant steps every 4 ms, which is no multiple of the controller's {1000 * dt_s:g} ms; "
        "cure: another time step of either, or several of MuJoCo's steps in a step of the plant"
    )


@pytest.mark.parametrize("dt_s", [0, -0.001, np.nan, np.inf])
def test_time_steps_that_are_not_positive_and_finite_are_refused(dt_s):
    cure = "limit above 0 and finite; cure: the length of a step in s"
    assert refusal(controller_steps, 0.004, dt_s) == f"dt_s is {dt_s:g} s, {cure}"
    assert refusal(controller_steps, dt_s, 0.001) == f"the plant's dt_s is {dt_s:g} s, {cure}"


@pytest.mark.parametrize("ticks", [1, 5])
def test_a_simulators_step_is_compared_in_the_second_call_of_every_run(ticks):
    clock = SimulatorClock(0.001)
    clock.check(7.0, 0)  # a run may begin at any time
    clock.check(7.0 + 0.001 * ticks, ticks)
    clock.begin()
    clock.check(0.001, 0)
    assert refusal(clock.check, 0.001 + 0.002 * ticks, ticks) == (
        "the loop is made for time steps of 1 ms, the simulator's are 2 ms, so the plant would run "
        "at another speed; cure: Loop(..., dt_s=0.002), or a simulator with dt=0.001"
    )


def test_a_simulators_time_that_does_not_rise_is_refused():
    clock = SimulatorClock(0.001)
    clock.check(0.008, 7)
    for time_s in (0.008, 0.001):
        assert f"went from 0.008 s to {time_s:g} s within a run" in refusal(clock.check, time_s, 8)


def plant_clock(**members):
    """Return a plant that steps every 4 ms, and its clock in a run that has begun."""
    plant = SimpleNamespace(dt_s=0.004, time_s=1.0, **members)
    clock = PlantClock(plant)
    clock.begin()
    return plant, clock


def test_a_plant_whose_steps_take_another_time_is_refused_in_the_first_one():
    plant, clock = plant_clock()
    plant.time_s += 0.016
    assert refusal(clock.check) == (
        "a step of the plant took 16 ms by its time_s, but its dt_s was 4 ms when the loop was "
        "made; cure: let both agree, with all of MuJoCo's steps in a step"
    )


@pytest.mark.parametrize("later_s", [1.004, 1.024])
def test_a_plant_that_stands_or_jumps_later_is_refused(later_s):
    plant, clock = plant_clock()
    plant.time_s = 1.004
    clock.check()
    plant.time_s = later_s
    assert refusal(clock.check).startswith(
        f"a step of the plant took {1000 * (later_s - 1.004):g} ms by its time_s, but its dt_s was"
    )


def test_a_plant_whose_time_step_changes_after_the_loop_was_made_is_refused():
    plant, clock = plant_clock()
    plant.dt_s = 0.002
    plant.time_s += plant.dt_s
    assert refusal(clock.check).startswith("a step of the plant took 2 ms by its time_s, but its")


def test_the_steps_of_a_plant_with_links_are_checked():
    _plant, clock = plant_clock(link="forearm")  # as a user may call a part of an arm
    assert refusal(clock.check).startswith("a step of the plant took 0 ms")


def test_a_plant_whose_time_goes_back_within_a_run_has_diverged():
    plant, clock = plant_clock()
    for plant.time_s in (1.004, 1.008):
        clock.check()
    plant.time_s = 0.0
    with pytest.raises(DivergedError, match=r"went from 1\.008 s to 0 s within a run: it was"):
        clock.check()


def test_a_robot_at_the_end_of_a_link_may_be_held_or_miss_steps():
    plant, clock = plant_clock(has_own_clock=True)
    for plant.time_s in (1.0, 1.0, 1.02):
        clock.check()
