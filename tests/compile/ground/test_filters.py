"""The filter that a connection asks of its target's compartments."""

import nengo
import pytest

from spikeport.compile.ground.filters import asked_filter_s, time_constant_s


@pytest.fixture
def ends() -> tuple[nengo.Node, nengo.Ensemble, nengo.Ensemble]:
    with nengo.Network(add_to_container=False) as network:
        pair = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1)
        node = nengo.Node([0])
    network.__enter__()
    yield node, *pair
    network.__exit__(None, None, None)


def test_connections_that_send_values_ask_for_nengo_loihis_filter_of_5_ms(ends) -> None:
    node, a, b = ends
    for pre, on_chip in ((node, False), (a, True), (a, False), (a.neurons, True)):
        transform = [[1] * pre.size_out]
        connection = nengo.Connection(pre, b, transform=transform, synapse=0.1)
        assert asked_filter_s(connection, on_chip) == 0.005


def test_connections_that_send_spikes_ask_for_the_filter_of_their_own_synapse(ends) -> None:
    node, a, b = ends
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=0.1), True) == 0.1
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=None), False) == 0
    weights = nengo.solvers.LstsqL2(weights=True)
    assert asked_filter_s(nengo.Connection(a, b, solver=weights, synapse=0.1), True) == 0.1
    into = nengo.Connection(node, b.neurons, transform=[[1]] * 4, synapse=0.1)
    assert asked_filter_s(into, False) == 0.005


def test_a_connection_without_a_synapse_has_a_time_constant_of_0(ends) -> None:
    _, a, b = ends
    assert time_constant_s(nengo.Connection(a, b, synapse=None)) == 0
