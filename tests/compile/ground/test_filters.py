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


def test_values_ask_for_the_filter_behind_decode_neurons(ends) -> None:
    node, a, b = ends
    for pre, on_chip in ((node, False), (a, True), (a, False), (a.neurons, True)):
        transform = [[1] * pre.size_out]
        connection = nengo.Connection(pre, b, transform=transform, synapse=0.1)
        assert asked_filter_s(connection, on_chip) == 0.005


def test_spikes_to_neurons_ask_for_their_own(ends) -> None:
    node, a, b = ends
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=0.1), True) == 0.1
    assert asked_filter_s(nengo.Connection(a.neurons, b.neurons, synapse=None), False) == 0
    weights = nengo.solvers.LstsqL2(weights=True)
    assert asked_filter_s(nengo.Connection(a, b, solver=weights, synapse=0.1), True) == 0.1
    into = nengo.Connection(node, b.neurons, transform=[[1]] * 4, synapse=0.1)
    assert asked_filter_s(into, False) == 0.005


def test_no_filter_has_no_time_constant(ends) -> None:
    _, a, b = ends
    assert time_constant_s(nengo.Connection(a, b, synapse=None)) == 0
