"""The least number of compartments of a network, before anything is built."""

from itertools import pairwise

import nengo
import numpy as np
import pytest
from nengo_loihi.decode_neurons import DecodeNeurons, OnOffDecodeNeurons, Preset5DecodeNeurons

from spikeport import add_params, compile_network
from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.compile.rewriting.relays import compartments_at_least, neurons_per_value
from tests.helpers.small_networks import scope_of

PER_VALUE = neurons_per_value(AS_USUAL)


def bound(network: nengo.Network, settings: BuildSettings = AS_USUAL) -> int:
    return compartments_at_least(scope_of(network), settings)


def through_nodes() -> nengo.Network:
    with nengo.Network(seed=1) as network:
        a, b, c = nengo.Ensemble(20, 2), nengo.Ensemble(20, 2), nengo.Ensemble(30, 1)
        n, m = nengo.Node(size_in=2), nengo.Node(size_in=2)
        nengo.Connection(a, n, synapse=None)
        nengo.Connection(b[0], n[1], synapse=None)
        nengo.Connection(n, m, transform=[[1, 0], [0, 2]])
        nengo.Connection(m[0], c, synapse=None)
        nengo.Connection(m, a, synapse=None)
        nengo.Connection(a, c, function=lambda x: x[0])
        nengo.Connection(a.neurons, c.neurons, transform=np.full((30, 20), 1e-3))
        nengo.Connection(a, b, solver=nengo.solvers.LstsqL2(weights=True))
    return network


def test_the_bound_equals_the_compartments_that_are_built() -> None:
    network = through_nodes()
    image = compile_network(network).image
    assert bound(network) == image.n_compartments == 70 + PER_VALUE * (1 + 1 + 2 + 2)


@pytest.mark.parametrize(
    "settings",
    [
        BuildSettings(decode_neurons=OnOffDecodeNeurons()),
        BuildSettings(decode_neurons=Preset5DecodeNeurons()),
        BuildSettings(remove_passthrough=False),
        BuildSettings(remove_passthrough=False, decode_neurons=OnOffDecodeNeurons(2)),
    ],
)
def test_the_bound_with_settings_equals_the_compartments_that_are_built(
    settings: BuildSettings,
) -> None:
    network = through_nodes()
    image = compile_network(network, settings=settings).image
    readouts = sum(
        int(n)
        for n, entry in zip(np.diff(image.blocks.start), image.manifest.blocks, strict=True)
        if entry.kind == "readout"
    )
    assert bound(network, settings) == image.n_compartments - readouts


def test_decode_neurons_of_an_unknown_class_are_not_counted() -> None:
    settings = BuildSettings(decode_neurons=DecodeNeurons())
    assert bound(through_nodes(), settings) == 70


def test_the_bound_of_a_network_shrinks_with_fewer_decode_neurons() -> None:
    with nengo.Network(seed=1) as network:
        chain = [nengo.Ensemble(32, 16) for _ in range(410)]
        for pre, post in pairwise(chain):
            nengo.Connection(pre, post)
    few = BuildSettings(decode_neurons=OnOffDecodeNeurons())
    assert bound(network) > 128 * 1024
    assert bound(network, few) == 410 * 32 + 409 * 16 * 2


def test_connections_from_or_to_the_host_take_no_decode_neurons() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(7, 1)
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a, nengo.Node(lambda t, x: None, size_in=1))
        host = nengo.Ensemble(5, 1)
        add_params(network)
        network.config[host].on_chip = False
        nengo.Connection(a, host)
        nengo.Connection(host, a)
    assert bound(network) == 7


def test_a_connection_whose_path_the_user_set_is_not_counted() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(7, 1)
        loop = nengo.Connection(a, a)
    assert bound(network) == 7 + PER_VALUE
    add_params(network)
    network.config[loop].decode_path = "onoff"
    assert bound(network) == 7


def test_a_random_transform_is_counted_for_every_value() -> None:
    with nengo.Network(seed=1) as network:
        a, node = nengo.Ensemble(7, 2), nengo.Node(size_in=2)
        nengo.Connection(a, node, transform=nengo.dists.Choice([[1.0]]))
        nengo.Connection(node, a, synapse=None)
    assert bound(network) == 7 + PER_VALUE * 2


def test_values_that_a_slice_adds_up_are_counted_for_each_source() -> None:
    with nengo.Network(seed=1) as network:
        a, b, c = (nengo.Ensemble(7, 1) for _ in range(3))
        both, one = nengo.Node(size_in=2), nengo.Node(size_in=1)
        nengo.Connection(a, both[0], synapse=None)
        nengo.Connection(b, both[1], synapse=None)
        nengo.Connection(both, one[[0, 0]], synapse=None)
        nengo.Connection(one, c)
    assert bound(network) == 3 * 7 + 2 * PER_VALUE


def test_products_that_are_only_rounding_are_not_counted() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(7, 1), nengo.Ensemble(7, 1)
        one, c = nengo.Node(size_in=1), nengo.Ensemble(7, 1)
        nengo.Connection(a, one, transform=np.cos(np.pi / 2), synapse=None)  # 6e-17
        nengo.Connection(b, one, synapse=None)
        nengo.Connection(one, c)
    assert bound(network) == 3 * 7 + PER_VALUE
