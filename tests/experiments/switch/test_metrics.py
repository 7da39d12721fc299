"""The success of a phase, on runs that are made up."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.switch.metrics import (
    by_controller,
    metrics,
    phase_metrics,
    switched_after_s,
    within,
)
from spikeport.experiments.switch.schedule import Phase
from spikeport.experiments.walk.paths import find_path

WALK = {"walk": 0.8, "draw": 0.4}


def phase(begin_s, end_s, utilities, **goal):
    return Phase(name="one", begin_s=begin_s, end_s=end_s, utilities=utilities, **goal)


def test_a_phase_begins_with_its_first_step_after_hours_of_steps():
    time_s = np.cumsum(np.full(2_000_010, 0.005))
    begun = within(time_s, phase(10_000.0, 10_001.0, {"walk": 1.0}, path="line"))
    assert 1e-9 < 10_000.0 - time_s[1_999_999] < 1e-6  # a sum of steps, and rounded
    assert np.flatnonzero(begun)[0] == 1_999_999


def test_a_switch_is_over_once_the_gate_of_the_action_alone_stays_open():
    gates = np.tile([0.9, 0.1], (1000, 1))
    gates[500:] = 0.1, 0.9
    gates[520:530] = 0.6, 0.9
    assert switched_after_s(gates, "draw", 0.5, 1.0) == pytest.approx(0.031)
    assert switched_after_s(gates, "walk", 0.0, 0.5) == 0


@pytest.mark.parametrize("late", [1, 7])
def test_a_switch_takes_the_steps_until_the_gate_opens(late):
    # Row i is the gate at the end of step i + 1: row 499 as the phase begins.
    gates = np.tile([0.9, 0.1], (1000, 1))
    gates[499 + late :] = 0.1, 0.9
    took = switched_after_s(gates, "draw", 0.5, 1.0)
    assert took == pytest.approx(0.001 * late)


def test_the_first_switch_counts_from_the_beginning_of_the_run():
    # The run's beginning has no row: the gate opens in row 24, at the end of step 25.
    gates = np.tile([0.1, 0.1], (1000, 1))
    gates[24:] = 0.9, 0.1
    assert switched_after_s(gates, "walk", 0.0, 0.5) == pytest.approx(0.025)


def test_phases_by_a_robots_clock_are_found_in_the_controllers_steps():
    time_s = 0.005 * np.arange(200)
    assert by_controller(time_s, 0.5, 1.0, 7.0) == pytest.approx([0.5, 1.0, 1.0])
    stalled = time_s + 0.3 * (np.arange(200) >= 80)  # at 0.4 s of the controller
    assert by_controller(stalled, 0.2, 0.75, 1.3) == pytest.approx([0.2, 0.45, 1.0])


@pytest.mark.parametrize(
    ("off_m", "read_as", "anchored", "success"),
    [
        (0.007, 8, True, True),
        (0.007, None, True, True),
        (0.007, 3, True, False),
        (0.009, 8, True, False),
        (0.011, 8, False, True),
        (0.013, 8, False, False),
    ],
)
def test_a_drawing_succeeds_if_near_its_shape_and_not_read_as_another_digit(
    worked, off_m, read_as, anchored, success
):
    (figures,) = phase_metrics(worked("digit", off_m, read_as, anchored))
    assert (figures["success"], figures["recognised_as"]) == (success, read_as)
    assert figures["shape_error_rms_m"] == pytest.approx(off_m, abs=1e-3)


@pytest.mark.parametrize(("off_m", "success"), [(0.03, True), (0.05, False)])
def test_a_retraction_succeeds_if_the_hand_ends_near_where_it_hangs(worked, off_m, success):
    (figures,) = phase_metrics(worked("retract", off_m))
    assert (figures["success"], figures["hand_error_m"]) == (success, pytest.approx(off_m))


@pytest.mark.parametrize("jumps", [0, 3])
def test_a_target_must_be_reached_before_the_next_appears(worked, jumps):
    (figures,) = phase_metrics(worked("reach", jumps=jumps))
    assert (figures["success"], figures["targets_reached"]) == (jumps > 0, jumps)


@pytest.mark.parametrize(
    ("off_m", "behind_m", "success"), [(0.1, 0.9, True), (0.3, 0.9, False), (0.1, 1.1, False)]
)
def test_a_walk_succeeds_if_near_its_path_and_not_far_behind(worked, off_m, behind_m, success):
    done = worked("reach")
    path = find_path("line", 0.5, 10.0)
    goal = phase(0.0, 6.0, WALK, path="line")
    reference_m = np.array([path.at(t)[:2] for t in done.recording.time_s])
    done.goals = [SimpleNamespace(phase=goal)]
    done.paths, done.gates = [path], np.tile([0.9, 0.1], (6000, 1))
    done.recording.reference = reference_m + np.array([behind_m, off_m])
    done.recording.position_m = reference_m + np.array([0.0, off_m])
    (figures,) = phase_metrics(done)
    assert figures["success"] is success
    assert figures["path_error_rms_m"] == pytest.approx(off_m)
    assert figures["behind_m"] == pytest.approx(behind_m)


def test_the_pelvis_movement_is_the_largest_distance_from_where_the_work_began(worked):
    done = worked("retract")
    done.recording.position_m[:] = 3.0
    done.recording.position_m[100:200] += (0.03, -0.04)
    assert phase_metrics(done)[0]["pelvis_moved_m"] == pytest.approx(0.05)


@pytest.mark.parametrize("late", [{"switch_s": 0.046}, {"fallen_at_s": 5.0}])
def test_a_phase_with_a_late_switch_or_a_fall_does_not_succeed(worked, late):
    assert phase_metrics(worked("retract"))[0]["success"]
    assert not phase_metrics(worked("retract", **late))[0]["success"]


def test_the_figures_of_a_run_sum_up_its_phases(worked):
    done, sim = worked("digit", 0.005, read_as=8), SimpleNamespace(time=6.0, image=None)
    sim.activity = SimpleNamespace(totals=lambda: {"spikes": 12})
    done.sim, done.wall_s = sim, 3.0
    figures = metrics(done)
    assert (figures["phases_done"], figures["recognised_as"]) == (1, 8)
    assert figures["shape_error_rms_m"] == pytest.approx(0.005, abs=1e-3)
    assert (figures["spikes_per_second"], figures["real_time_factor"]) == (2, 2)
