"""Clusters of passthrough nodes, and those that nengo-loihi replaces."""

import itertools

import nengo
import pytest

from spikeport.compile.ground.clusters import clusters, replaced_clusters
from tests.helpers.small_networks import scope_of


def chain(n_nodes: int, from_chip: bool, to_chip: bool) -> nengo.Network:
    """Return passthrough nodes in a chain, with a source and a target on host or chip."""
    with nengo.Network() as network:
        nodes = [nengo.Node(size_in=1) for _ in range(n_nodes)]
        first, last = (
            nengo.Ensemble(5, 1) if on_chip else nengo.Node(lambda t, x: x, size_in=1)
            for on_chip in (from_chip, to_chip)
        )
        path = [first, *nodes, last]
        for pre, post in itertools.pairwise(path):
            nengo.Connection(pre, post)
    return network


def test_connected_nodes_are_one_cluster_with_all_connections_that_touch_it() -> None:
    network = chain(3, from_chip=True, to_chip=True)
    with network:
        alone = nengo.Node(size_in=1)
    first, second = clusters(network)
    assert (list(first[0]), first[1]) == (network.all_nodes[:3], network.all_connections)
    assert (list(second[0]), second[1]) == ([alone], [])


@pytest.mark.parametrize("from_chip", [False, True])
@pytest.mark.parametrize("to_chip", [False, True])
def test_only_clusters_between_ensembles_on_the_chip_are_replaced(
    from_chip: bool, to_chip: bool
) -> None:
    network = chain(2, from_chip, to_chip)
    found = [(into, out) for _, into, out in replaced_clusters(scope_of(network))]
    first, *_, last = network.all_connections
    assert found == ([([first], [last])] if from_chip and to_chip else [])
