import nengo
import numpy as np
import pytest

from spikeport.networks.at_rest import at_rest


@pytest.mark.parametrize("kind", [nengo.LIF, nengo.SpikingRectifiedLinear])
def test_neurons_start_at_zero_as_on_the_chip(kind):
    with nengo.Network(seed=0) as net:
        resting = nengo.Ensemble(50, 1, neuron_type=kind(initial_state=at_rest()))
        usual = nengo.Ensemble(50, 1, neuron_type=kind())
    with nengo.Simulator(net, progress_bar=False) as sim:
        voltages = [
            sim.signals[sim.model.sig[one.neurons]["voltage"]].copy() for one in (resting, usual)
        ]
    np.testing.assert_array_equal(voltages[0], 0.0)
    assert voltages[1].any()  # as Nengo draws them
