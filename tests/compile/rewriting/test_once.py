"""Objects that several networks list, which are compiled once."""

import nengo
import numpy as np
import pytest

from spikeport.compile.check.memory import estimate
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.once import each_once
from spikeport.compile.rewriting.relays import compartments_at_least
from tests.helpers.small_networks import rewrite_of, scope_of

LISTED = ["u", "a", "node", "into", "decoded", "out", "probe"]


def listing(*again: str, part: bool = False) -> nengo.Network:
    """Return a network with seeds whose subnetwork lists some of its objects again."""
    with nengo.Network(seed=1) as network:
        u, node = nengo.Node(0.7), nengo.Node(size_in=1)
        a, b = nengo.Ensemble(30, 1, seed=1, label="a"), nengo.Ensemble(40, 2, seed=2, label="b")
        into = nengo.Connection(u, a, seed=3)
        decoded = nengo.Connection(a, node, synapse=None, seed=4)
        target = b[0] if part else b
        out = nengo.Connection(node, target, transform=np.ones((target.size_in, 1)), seed=5)
        probe = nengo.Probe(b, seed=6)
        objects = {"u": u, "a": a, "node": node, "into": into, "decoded": decoded}
        objects |= {"out": out, "probe": probe}
        with nengo.Network() as inner:
            for name in again:
                inner.add(objects[name])
    return network


@pytest.mark.parametrize("part", [False, True])
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("again", LISTED)
def test_an_object_that_is_listed_twice_is_compiled_once(
    again: str, pipeline: str, part: bool
) -> None:
    twice, once = listing(again, part=part), listing(part=part)
    digests = {compile_network(net, pipeline=pipeline).image.digest for net in (twice, once)}
    assert len(digests) == 1


def test_objects_that_are_listed_twice_are_counted_once() -> None:
    twice, once = listing(*LISTED), listing()
    assert compartments_at_least(scope_of(twice)) == compartments_at_least(scope_of(once))
    assert estimate(twice) == estimate(once)
    rewrite = rewrite_of(twice)
    assert len(each_once(rewrite).network.all_objects) == len(once.all_objects) - 1


def test_a_network_that_lists_nothing_twice_is_unchanged() -> None:
    rewrite = rewrite_of(listing())
    assert each_once(rewrite) is rewrite
