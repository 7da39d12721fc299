import nengo
import numpy as np
import pytest

from spikeport.networks.path_follower import FollowerOptions
from spikeport.networks.rotation import HALVES, ROTATION, Squares, rotate


def test_the_squares_make_a_rotation():
    angle, vector = 1.1, np.array([0.3, -0.5])
    c, s = np.cos(angle), np.sin(angle)
    turned = ROTATION @ np.square(HALVES @ [*vector, c, s])
    assert turned == pytest.approx([[c, s], [-s, c]] @ vector)


def test_neurons_turn_a_vector_backwards():
    """To 0.05; 0.025 when written."""
    with nengo.Network(seed=1) as network:
        shown = nengo.Node([0.3, -0.5, 0.0, 1.0])
        body = nengo.Ensemble(2, 2, neuron_type=nengo.Direct())
        rotate(shown, body, Squares(n_neurons=50, max_rates=(200.0, 400.0), tau=0.005))
        probe = nengo.Probe(body)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run(0.3)
    found = sim.data[probe][-200:].mean(axis=0)
    assert found == pytest.approx([-0.5, -0.3], abs=0.05)


def test_each_default_rate_occurs_at_intercepts_all_over_the_range():
    options = FollowerOptions()
    squares = Squares(options.n_square, options.rates, options.tau_fwd)
    with nengo.Network() as network:
        rotate(nengo.Node([0, 0, 0, 1]), nengo.Ensemble(2, 2), squares)
    square = next(one for one in network.ensembles if one.label == "square 1")
    n = options.n_square // 2
    rates, intercepts = square.max_rates[:n], square.intercepts[:n]
    found = {rate: intercepts[rates == rate] for rate in np.unique(rates)}
    assert len(found) == 10
    for places in found.values():
        assert len(places) == 7
        assert np.ptp(places) > 0.85 * np.ptp(intercepts)
