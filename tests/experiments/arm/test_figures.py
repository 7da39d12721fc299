"""Figures of a run of the arm."""

import numpy as np
import pytest

from spikeport.experiments.arm import reach
from tests.helpers.arm_runs import finished

RESULT = {
    "settings": {"box": "small"},
    "metrics": {"reaches": 0},
    "seeds": {"run": 0},
    "seconds": 0.01,
    "backend": "analytic",
    "resources": None,
}


def reached(distances, at_limit=None, **parts):
    """Return the axes of a reach run's figure, by their labels."""
    at_limit = np.zeros(len(distances), bool) if at_limit is None else at_limit
    run = finished(distances, at_limit=at_limit)._replace(**parts)
    return {axes.get_ylabel(): axes for axes in reach.reach_figure(run, (), RESULT).axes}


def points(line):
    return np.transpose(line.get_data()).tolist()


def test_a_joint_at_its_limit_is_marked_in_the_figure():
    def marks(at_limit):
        legend = reached([0.3, 0.4], at_limit)["distance to target (cm)"].get_legend()
        return [text.get_text() for text in legend.get_texts()]

    assert marks([False, False]) == ["reached below 4 cm"]
    assert marks([False, True]) == ["reached below 4 cm", "joint at its limit (steps: 1)"]


def test_distances_are_in_cm_and_marks_are_where_they_say():
    axes = reached([0.3, 0.4], [False, True])["distance to target (cm)"]
    distance, reached_below, at_limit = axes.lines
    assert points(distance) == [[0.0, 30.0], [0.005, 40.0]]
    assert points(reached_below) == [[0, 4.0], [1, 4.0]]  # across the whole width of the axes
    assert points(at_limit) == [[0.005, 0.0]]


@pytest.mark.parametrize(("n_steps", "n_errors"), [(16, 8), (17, 8), (15_003, 3_000)])
def test_a_neuron_that_fires_with_the_error_is_drawn_above_one_that_does_not(n_steps, n_errors):
    """A run may end within a physics step; its steps are then no multiple of the errors."""
    # The error comes in the last eighth of the run, in which only the first neuron fires.
    error, first = (np.arange(n) >= 7 / 8 * n for n in (n_errors, n_steps))
    axes = reached(0.1 * error, rasters={"x": np.stack((first, ~first), axis=1)})["M1 x neuron"]
    seconds, neuron = axes.collections[0].get_offsets().T
    assert (neuron == 1).sum() == first.sum()
    assert seconds[neuron == 0].max() < seconds[neuron == 1].min()
