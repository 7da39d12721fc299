"""The path follower without neurons, and the inputs that every follower has."""

import nengo
import numpy as np
import pytest

from spikeport.networks.analytic_follower import analytic_follower, from_inputs
from spikeport.networks.path_following import FollowerGains, exact_command


def test_the_command_is_that_of_the_law_one_step_late() -> None:
    gains = FollowerGains()
    reference, state = np.array([1.0, 0.5, 0.4, 0.1]), np.array([0.3, 0.8, 0.2, 0.5, 0.0])
    with nengo.Network() as network:
        follower = analytic_follower(gains)
        nengo.Connection(nengo.Node(reference), follower.reference, synapse=None)
        nengo.Connection(nengo.Node(state), follower.state, synapse=None)
        probe = nengo.Probe(follower.command)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        simulator.run_steps(3)
        found = simulator.data[probe]
    assert found[0].tolist() == [0, 0]
    assert found[1:] == pytest.approx(np.array([exact_command(gains, reference, state)] * 2))


def test_a_function_gets_the_reference_followed_by_the_state() -> None:
    net, computed = from_inputs("sum", lambda values: values[[0, 3, 4, 8]], 4)
    with nengo.Network() as network:
        network.add(net)
        nengo.Connection(nengo.Node(np.arange(4.0)), net.reference, synapse=None)
        nengo.Connection(nengo.Node(10 + np.arange(5.0)), net.state, synapse=None)
        probe = nengo.Probe(computed)
    with nengo.Simulator(network, progress_bar=False) as simulator:
        simulator.run_steps(2)
        assert simulator.data[probe][-1].tolist() == [0, 3, 10, 14]
    assert (net.label, net.filters) == ("sum", {})
