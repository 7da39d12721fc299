import numpy as np
import pytest

from spikeport.experiments.arm.draw_task import APPROACH_S, REST_S, DrawTask, Sheet
from spikeport.experiments.curves import arc_length

HAND = np.array([0.3, -0.3, 1.1])
SHEET = Sheet()
LEFT, RIGHT, DOWN, UP = [0, 0.5], [1, 0.5], [0.5, 0], [0.5, 1]


def path(task, seconds, dt_s=0.005):
    found = [task.target]
    for step in range(1, round(seconds / dt_s)):
        task.update(step * dt_s, HAND)
        found.append(task.target)
    return np.array(found)


@pytest.fixture(scope="module")
def drawn():
    return path(DrawTask(SHEET.stroke(2), HAND, 8.0), 8.0)


def test_the_sheet_is_14_by_20_cm_in_front_of_the_right_arm():
    left, right, down, up = SHEET.place(np.array([LEFT, RIGHT, DOWN, UP]))
    assert (right - left).tolist() == pytest.approx([0, -0.14, 0])  # its right is towards -y
    assert (up - down).tolist() == pytest.approx([0, 0, 0.20])
    assert (left + right).tolist() == pytest.approx([0.70, -0.40, 2.48])


def test_points_placed_on_the_sheet_project_back_to_metres_from_its_centre():
    unit = np.random.RandomState(0).rand(20, 2)
    assert SHEET.project(SHEET.place(unit)) == pytest.approx((unit - 0.5) * [0.14, 0.20])


def test_the_pen_begins_at_the_hand_and_comes_smoothly_to_the_stroke(drawn):
    assert drawn[0].tolist() == HAND.tolist()
    approach = drawn[: round(APPROACH_S / 0.005)]
    speed = np.linalg.norm(np.diff(approach, axis=0), axis=1) / 0.005
    assert speed[[0, -1]].max() < 0.01
    way = np.linalg.norm(SHEET.stroke(2)[0] - HAND)
    assert speed.max() == pytest.approx(1.875 * way / APPROACH_S, rel=1e-3)  # of minimum jerk


def test_the_pen_rests_before_and_after_the_drawing(drawn):
    stroke = SHEET.stroke(2)
    before = drawn[round(APPROACH_S / 0.005) : round(DrawTask.begin_s / 0.005)]
    after = drawn[-round(REST_S / 0.005) + 1 :]
    assert (before == stroke[0]).all()
    assert after == pytest.approx(np.repeat(stroke[-1:], len(after), axis=0))


def test_the_pen_draws_the_whole_stroke_at_an_even_speed(drawn):
    drawing = drawn[round(DrawTask.begin_s / 0.005) :]
    assert arc_length(drawing)[-1] == pytest.approx(arc_length(SHEET.stroke(2))[-1], rel=1e-3)
    speed = np.linalg.norm(np.diff(drawing, axis=0), axis=1) / 0.005
    steady = speed[120:-220]
    assert len(steady) > 600
    assert steady == pytest.approx(np.full(len(steady), steady.mean()), rel=0.02)
    assert speed[[0, -1]].max() < 0.02 * steady.mean()


def test_the_pen_stays_at_the_end():
    task = DrawTask(SHEET.stroke(1), HAND, 5.0)
    task.update(1e6, HAND)
    assert task.target == pytest.approx(SHEET.stroke(1)[-1])
