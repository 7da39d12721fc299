import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.experiments.arm.reach_task import (
    BOXES,
    MIN_JUMP_M,
    REACHED_M,
    SHOULDER_M,
    GridTour,
    ReachTask,
    TargetBox,
    find_box,
)

HAND = np.array([0.3, -0.2, 1.2])


def targets(box, seed, n=300):
    task = ReachTask(box, seed, HAND)
    found = [task.target]
    for i in range(n):
        task.update(0.1 * i, task.target)
        found.append(task.target)
    return np.array(found)


@pytest.fixture(params=BOXES)
def box(request):
    return BOXES[request.param]


def test_targets_lie_in_the_box(box):
    found = targets(box, 0)
    assert (found >= box.low_m).all()
    assert (found <= box.high_m).all()


def test_targets_fill_the_box(box):
    found = targets(box, 0)
    size = np.subtract(box.high_m, box.low_m)
    assert (np.ptp(found, axis=0) > 0.9 * size).all()


def test_a_target_is_at_least_ten_centimetres_from_the_last_and_the_first_from_the_hand(box):
    path = np.vstack([HAND, targets(box, 0)])
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).min() >= MIN_JUMP_M == 0.10


def test_targets_lie_in_the_shell_around_the_shoulder():
    box = BOXES["large"]
    assert box.shell_m == (0.27, 0.56)
    distances = np.linalg.norm(targets(box, 0) - SHOULDER_M, axis=1)
    assert (distances >= 0.27).all()
    assert (distances <= 0.56).all()
    assert not box.reachable(np.array(box.high_m) + 1)


def test_the_shell_leaves_out_corners_of_the_large_box():
    corners = BOXES["large"].grid(2)
    assert 0 < len(corners) < 8


@pytest.mark.parametrize(("distance", "reached"), [(0.0399, 1), (0.0401, 0)])
def test_a_target_counts_as_reached_below_four_centimetres(distance, reached):
    task = ReachTask(BOXES["small"], 0, HAND)
    before = task.target.copy()
    task.update(0.5, before + np.array([0, 0, distance]))
    assert REACHED_M == 0.04
    assert task.reach_times_s == [0.5] * reached
    assert np.array_equal(task.target, before) == (not reached)


def test_each_update_at_the_target_counts_one_reach():
    task = ReachTask(BOXES["small"], 0, HAND)
    for time_s in (0.1, 0.2, 0.3):
        task.update(time_s, task.target)
    assert task.reach_times_s == [0.1, 0.2, 0.3]


def test_targets_follow_from_the_seed(box):
    assert np.array_equal(targets(box, 4), targets(box, 4))
    assert not np.array_equal(targets(box, 4)[0], targets(box, 5)[0])


def test_a_grid_spans_its_box():
    box = TargetBox((0.0, -1.0, 2.0), (1.0, 1.0, 4.0))
    grid = box.grid(3)
    assert len(grid) == len(np.unique(grid, axis=0)) == 27
    assert grid.min(axis=0).tolist() == [0.0, -1.0, 2.0]
    assert grid.max(axis=0).tolist() == [1.0, 1.0, 4.0]


def test_long_edges_of_a_grid_have_more_points():
    box = TargetBox((0.0, 0.0, 0.0), (0.1, 0.3, 0.35))
    across, along, up = (np.unique(edge.round(9)) for edge in box.grid(3, 0.1).T)
    assert across.tolist() == [0.0, 0.05, 0.1]
    assert along.tolist() == [0.0, 0.1, 0.2, 0.3]
    assert len(up) == 5


def test_a_tour_visits_every_point_of_the_grid_for_its_time(box):
    tour = GridTour(box, points=3, dwell_s=0.5)
    grid = box.grid(3)
    assert tour.seconds == 0.5 * len(grid)
    seen = []
    for step in range(round(tour.seconds / 0.1)):
        tour.update(0.1 * step + 0.05, HAND)
        seen.append(tuple(tour.target))
    assert {tuple(point) for point in grid} == set(seen)
    assert [seen.count(point) for point in set(seen)] == [5] * len(grid)


def test_a_tour_that_is_over_stays_at_its_last_target(box):
    tour = GridTour(box)
    tour.update(tour.seconds + 100, HAND)
    last = tour.target
    tour.update(tour.seconds - 1e-6, HAND)
    assert np.array_equal(last, tour.target)


def test_a_tour_is_the_same_every_time(box):
    def path(tour):
        found = []
        for step in range(200):
            tour.update(0.1 * step, HAND)
            found.append(tour.target)
        return found

    assert np.array_equal(path(GridTour(box)), path(GridTour(box)))


def test_a_box_is_found_by_name_or_by_its_edges():
    assert find_box("large") is BOXES["large"]
    assert find_box("0.3:0.4,-0.3:-0.1,1.1:1.3") == TargetBox((0.3, -0.3, 1.1), (0.4, -0.1, 1.3))


@pytest.mark.parametrize("text", ["huge", "0:1,0:1", "0:1,0:1,0:nan", "0:1:2,0:1,0:1", ""])
def test_a_text_that_is_not_a_box_is_refused(text):
    with pytest.raises(UsageError) as caught:
        find_box(text)
    assert str(caught.value) == (
        f"unknown box '{text}'; choose from: large, small, x0:x1,y0:y1,z0:z1 (m)"
    )


def test_a_box_that_no_arm_reaches_is_refused():
    with pytest.raises(UsageError, match="each edge must be from -3 to 3 m"):
        find_box("0.3:1e160,-0.3:0,1:1.2")


RISES = "and must rise; cure: a second number above the first"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1:0,0:1,0:1", f"x goes from 1 to 0 m, {RISES}"),
        ("0:1,0:1,0.3:0.3", f"z goes from 0.3 to 0.3 m, {RISES}"),
        (
            "0.2:0.3,-0.3:-0.2,0:0.1",
            "its diagonal is 0.173205 m, and must exceed 0.2 m; cure: longer edges",
        ),
    ],
)
def test_a_box_without_room_for_targets_is_refused(text, fault):
    with pytest.raises(UsageError) as caught:
        find_box(text)
    assert str(caught.value) == f"box {text}: {fault}"
