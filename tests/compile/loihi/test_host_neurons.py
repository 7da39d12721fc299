"""Neurons of the host that are silent at zero."""

import nengo
import numpy as np
import pytest

from spikeport.compile.loihi.host_neurons import SparseInputNeurons

DT_S = 0.001


@pytest.mark.parametrize("weight", [1.0, 2.0, 5.0])
def test_a_pair_of_neurons_sends_a_value_in_units_of_its_weight(weight):
    neurons = SparseInputNeurons(DT_S, weight)
    values = np.array([0.0, 0.3, -0.8, 1.0])
    with nengo.Network(seed=0) as net:
        node = nengo.Node(values)
        pairs = neurons.get_ensemble(4)
        nengo.Connection(node, pairs, synapse=None)
        spikes = nengo.Probe(pairs.neurons)
    with nengo.Simulator(net, dt=DT_S, progress_bar=False) as sim:
        sim.run_steps(1000)
    sent = (sim.data[spikes] > 0).mean(axis=0)
    on, off = sent[:4], sent[4:]
    np.testing.assert_allclose(on, np.maximum(values, 0) / weight, atol=0.003)
    np.testing.assert_allclose(off, np.maximum(-values, 0) / weight, atol=0.003)
    assert not np.any((on > 0) & (off > 0))
    encoders = neurons.get_post_encoders(np.eye(4))
    np.testing.assert_allclose(sent @ encoders, values, atol=0.003 * weight)
