import nengo
import numpy as np
import pytest

from spikeport.networks.plane_vectors import bearing_ensemble, length_ensemble

AHEAD_RAD = 0.5


@pytest.fixture
def bearing():
    with nengo.Network():
        return bearing_ensemble("b", 100, (400.0, 800.0), AHEAD_RAD)


def test_every_neuron_of_a_bearing_has_a_mirror_image(bearing):
    left, right = np.split(bearing.encoders, 2)
    assert (right == left * [1, -1]).all()
    for values in (bearing.intercepts, bearing.max_rates):
        left, right = np.split(values, 2)
        assert (left == right).all()


def test_most_neurons_of_a_bearing_bend_nearly_ahead(bearing):
    """A tuning curve bends at a right angle to the neuron's encoder, on either side."""
    angle = np.arctan2(*bearing.encoders.T[::-1])
    bend = np.minimum(np.abs(angle - np.pi / 2), np.abs(angle + np.pi / 2))
    assert 70 <= (bend <= AHEAD_RAD).sum() <= 90


def test_thresholds_and_rates_of_a_bearing_are_spread_evenly(bearing):
    for values, low, high in ((bearing.intercepts, -0.1, 0.1), (bearing.max_rates, 400, 800)):
        share = np.sort((values[:50] - low) / (high - low))
        assert np.abs(share - (np.arange(50) + 0.5) / 50).max() < 0.08


def test_most_evaluation_points_of_a_bearing_are_nearly_ahead(bearing):
    points = bearing.eval_points
    assert np.hypot(*points.T).max() <= 1
    assert points.mean(axis=0)[1] == pytest.approx(0, abs=1e-12)
    nearly = np.abs(np.arctan2(*points.T[::-1])) <= AHEAD_RAD
    assert nearly.mean() == pytest.approx(0.7 + 0.3 * AHEAD_RAD / np.pi, abs=0.03)


def test_encoders_of_a_length_favour_no_direction():
    with nengo.Network():
        encoders = length_ensemble("e", 100).encoders
    assert encoders.sum(axis=0) == pytest.approx([0, 0], abs=1e-12)
    assert encoders.T @ encoders == pytest.approx(50 * np.eye(2))
