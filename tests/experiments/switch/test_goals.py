"""Goals of a phase: a path from a stand to a stand, or a task of the arm."""

from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.switch.goals import (
    Goal,
    RetractTask,
    find_goals,
    from_stand_to_stand,
    hanging_hand,
)
from spikeport.experiments.switch.schedule import Phase
from spikeport.experiments.walk.paths import find_path


def test_a_path_is_walked_from_a_stand_to_a_stand():
    path = from_stand_to_stand(find_path("line", 0.5, 6.0), 6.0)
    x, y, vx, vy = np.array([path.at(t) for t in np.linspace(0, 6, 601)]).T
    assert (x[0], x[-1]) == pytest.approx((0, 2.5), abs=1e-3)
    assert (vx[1], vx[300], vx[-1]) == pytest.approx((0, 0.5, 0), abs=0.02)
    assert np.abs(np.diff(vx)).max() <= 0.5 * 0.02 + 1e-6
    assert not y.any()
    assert not vy.any()


def test_the_arm_is_retracted_to_where_it_hangs():
    begin = np.array([0.35, -0.2, 1.2])
    task = RetractTask(begin, 2.0)
    assert task.target.tolist() == begin.tolist()
    task.update(1.5, begin)
    assert task.target == pytest.approx(hanging_hand())


def test_a_drawing_phase_draws_the_digit_asked_for():
    phase = Phase(
        name="draw", begin_s=0, end_s=6, utilities={"walk": 0.4, "draw": 0.8}, arm="digit"
    )
    goal = Goal(phase, None, 5, (0, 0))
    task = goal.task(np.zeros(3))
    assert np.array_equal(task.stroke, Sheet().stroke(5))


def test_each_phase_that_reaches_draws_targets_of_its_own():
    phase = Phase(name="one", begin_s=0, end_s=6, utilities={"walk": 0.4, "draw": 0.8}, arm="reach")
    goals = find_goals(SimpleNamespace(phases=[phase, phase]), 8, 3)
    first, second = (goal.task(np.zeros(3)).target for goal in goals)
    assert not np.array_equal(first, second)
