"""Populations that compute one kinked line each."""

import nengo
import numpy as np
import pytest

from spikeport.networks.rectified import N_POINTS, Rectified

LINE = Rectified(threshold=0.2, slope=2.0, full=1.0, n_neurons=5, rates=(100.0, 200.0))


def built(radius: float = 1.5) -> nengo.Ensemble:
    with nengo.Network(seed=0):
        return LINE.ensemble(3, radius, np.random.RandomState(1), "line")


def test_neurons_are_silent_up_to_the_threshold_and_fire_at_their_rate_at_the_end() -> None:
    ensemble = built()
    assert (ensemble.n_neurons, ensemble.dimensions) == (15, 3)
    rates = []
    for value in (-1.0, 0.2, 0.6, 1.0):
        current = ensemble.gain * value / ensemble.radius + ensemble.bias
        rates.append(np.maximum(current, 0))
    assert not rates[0].any()
    np.testing.assert_allclose(rates[1], 0, atol=1e-9)
    np.testing.assert_allclose(rates[2], rates[3] / 2)
    assert 100 <= rates[3].min() < rates[3].max() <= 200


def test_each_neuron_encodes_one_dimension() -> None:
    assert built().encoders.tolist() == np.repeat(np.eye(3), 5, axis=0).tolist()


@pytest.mark.parametrize(("switches", "first"), [(False, 0.2), (True, 1.0)])
def test_decoders_are_solved_for_the_line(switches: bool, first: float) -> None:
    line = Rectified(0.2, 2.0, 1.0, 5, (100.0, 200.0), switches)
    decoding = line.decoding(3, weights=False)
    points, values = decoding["eval_points"], decoding["function"]
    assert points.shape == (N_POINTS, 3)
    assert (points[0] == first).all()
    assert (points[-1] == 1.0).all()
    np.testing.assert_allclose(values, 2 * (points - 0.2))


def test_populations_compute_their_lines() -> None:
    with nengo.Network(seed=0) as network:
        line = LINE.ensemble(2, 1.0, np.random.RandomState(1), "line")
        nengo.Connection(nengo.Node([0.7, 0.1]), line, synapse=None)
        out = nengo.Node(size_in=2)
        nengo.Connection(line, out, synapse=0.02, **LINE.decoding(2, weights=False))
        probe = nengo.Probe(out)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        simulator.run(0.4)
        found = simulator.data[probe][-200:].mean(axis=0)
    assert found == pytest.approx([2 * (0.7 - 0.2), 0], abs=0.02)
