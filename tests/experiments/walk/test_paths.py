import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.walk.paths import SHAPES, WalkPath, find_path

CLOSED = ["figure-eight", "loop"]


def steps_m(path, times):
    points = np.array([path.at(t)[:2] for t in times])
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


@pytest.mark.parametrize("name", SHAPES)
def test_a_path_begins_straight_ahead_at_its_speed(name):
    path = find_path(name, 0.4, 10.0)
    assert path.at(0.0) == pytest.approx([0, 0, 0.4, 0], abs=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_speed_is_constant(name):
    path, times = find_path(name, 0.5, 60.0), np.arange(0, 60, 0.05)
    assert steps_m(path, times) == pytest.approx(0.025, rel=2e-3)
    speeds = [np.linalg.norm(path.at(t)[2:]) for t in times]
    assert speeds == pytest.approx(np.full(len(times), 0.5), rel=1e-6)


@pytest.mark.parametrize("name", SHAPES)
def test_built_in_paths_turn_no_faster_than_the_policy_is_trained_for(name):
    path, times = find_path(name, 0.5, 60.0), np.arange(0, 60, 0.05)
    heading = np.unwrap([np.arctan2(*path.at(t)[:1:-1]) for t in times])
    turn_rad_s = np.abs(np.diff(heading)) / 0.05
    assert turn_rad_s.max() < 0.8
    assert turn_rad_s.max() > 0.7 or name != "loop"


def test_turns_that_are_too_fast_are_refused():
    with pytest.raises(UsageError) as caught:
        find_path("loop", 1.0, 10.0)
    assert str(caught.value) == (
        "path 'loop': turns by 1.54 rad/s at 1 m/s, limit 1 rad/s, for which the policy is "
        "trained; cure: a speed of at most 0.65 m/s"
    )


@pytest.mark.parametrize("name", CLOSED)
def test_a_closed_path_starts_over(name):
    path = find_path(name, 0.5, 1.0)
    lap_s = path.time_s[-1]
    assert path.at(lap_s + 3.0) == pytest.approx(path.at(3.0), abs=1e-4)
    assert path.at(lap_s - 1e-6)[:2] == pytest.approx([0, 0], abs=1e-4)


@pytest.mark.parametrize("name", SHAPES)
def test_a_ramp_reaches_the_speed_in_its_time(name):
    path, at_once = find_path(name, 0.5, 60.0, ramp_s=4.0), find_path(name, 0.5, 60.0)
    assert path.at(0.0) == pytest.approx([0, 0, 0, 0], abs=1e-9)
    speeds = [np.linalg.norm(path.at(t)[2:]) for t in (1.0, 2.0, 3.0)]
    assert speeds == pytest.approx([0.125, 0.25, 0.375], rel=1e-3)
    for t in (0.5, 3.0):  # the ramp puts the place of t^2 / (2 * 4 s) at time t
        assert path.at(t)[:2] == pytest.approx(at_once.at(t**2 / 8)[:2])
    # After the ramp, the path is two seconds late, lap after lap.
    for t in (4.0, 30.0, 59.0):
        assert path.at(t) == pytest.approx(at_once.at(t - 2.0))


def test_a_ramp_is_continuous():
    path, dt = find_path("s-curve", 0.5, 10.0, ramp_s=1.5), 1e-3
    times = np.arange(0, 3, dt)
    states = np.array([path.at(t) for t in times])
    moved = np.diff(states[:, :2], axis=0) / dt
    np.testing.assert_allclose(moved, (states[1:, 2:] + states[:-1, 2:]) / 2, atol=3e-3)


def test_a_ramp_is_refused_for_a_path_from_a_file(tmp_path):
    with pytest.raises(UsageError, match=r"ramp=2: '.*a\.csv' has times of its own; cure: leave"):
        find_path(str(tmp_path / "a.csv"), 0.5, 10.0, ramp_s=2.0)


def test_distances_are_to_the_nearest_point_of_the_path():
    path = find_path("line", 0.5, 10.0)
    places = np.array([[1.0, 0.3], [2.0, -0.1], [-0.3, 0.4], [5.4, 0.0]])
    assert path.distances_m(places) == pytest.approx([0.3, 0.1, 0.5, 0.4])


@pytest.mark.parametrize("name", SHAPES)
def test_points_on_a_path_have_no_distance_from_it(name):
    path = find_path(name, 0.5, 20.0)
    places = np.array([path.at(t)[:2] for t in np.linspace(0, 20, 997)])
    assert path.distances_m(places).max() < 1e-5


def test_a_path_may_be_a_single_point():
    path = WalkPath(np.array([0.0, 1.0]), np.ones((2, 2)))
    assert path.distances_m(np.array([[1.0, 3.0], [1.0, 1.0]])) == pytest.approx([2.0, 0.0])


def test_the_error_of_an_unknown_path_lists_the_paths():
    with pytest.raises(UsageError) as caught:
        find_path("circle", 0.5, 10.0)
    assert str(caught.value) == (
        "unknown path 'circle'; choose from: FILE.csv, figure-eight, line, loop, s-curve"
    )


def test_a_path_is_laid_from_the_place_and_heading_of_a_robot():
    laid = find_path("s-curve", 0.5, 10.0).laid(np.array([3.0, 2.0]), np.pi / 2)
    assert laid.at(0)[:2] == pytest.approx([3, 2])
    assert laid.at(0)[2:] == pytest.approx([0, 0.5], abs=1e-3)
    forward, left = find_path("s-curve", 0.5, 10.0).at(4.0)[:2]
    assert laid.at(4.0)[:2] == pytest.approx([3 - left, 2 + forward])
    assert find_path("line", 0.5, 10.0, ramp_s=2.0).laid(np.zeros(2), 0.0).ramp_s == 2.0


def test_the_loop_is_also_found_by_its_earlier_name_paper():
    earlier, now = find_path("paper", 0.5, 10.0), find_path("loop", 0.5, 10.0)
    np.testing.assert_array_equal(earlier.points, now.points)
    assert now.distances_m(np.array([[-1.0, 1.0]])) == pytest.approx([1.0], abs=0.01)


def test_the_reach_of_a_path_is_that_of_the_time_asked_for():
    assert find_path("line", 0.5, 40.0).farthest_m(20.0) == pytest.approx(10.0)
    assert find_path("line", 0.5, 40.0, ramp_s=4.0).farthest_m(20.0) == pytest.approx(9.0)
    assert find_path("figure-eight", 0.5, 40.0).farthest_m(1000.0) == pytest.approx(3.0, abs=1e-3)
