"""Flat networks: the seeds of objects that they take over, and the order of connections."""

import nengo

import spikeport
from spikeport.compile.rewriting.flat_network import FlatNetwork, construction_order
from tests.helpers.small_networks import rewrite_of


def test_a_flat_network_has_the_label_and_seed_of_the_old() -> None:
    with nengo.Network(label="old", seed=7) as network, nengo.Network() as inner:
        a = nengo.Ensemble(3, 1)
    spikeport.add_params(network)
    spikeport.add_params(inner)
    network.config[a].on_chip = False
    seeds = rewrite_of(network).all_seeds()
    flat = FlatNetwork(network, seeds)
    flat.keep(a)
    assert (flat.network.label, flat.network.seed) == ("old", 7)
    assert flat.network.ensembles == [a]
    assert flat.network.config[a].on_chip is False
    assert flat.seeds == {flat.network: 7, a: seeds[a]}


def test_a_new_object_can_have_the_seed_of_an_old_one() -> None:
    with nengo.Network(seed=7) as network:
        a, b = nengo.Ensemble(3, 1), nengo.Ensemble(3, 1)
    seeds = rewrite_of(network).all_seeds()
    flat = FlatNetwork(network, seeds)
    flat.inherit(b, a)
    assert flat.seeds[b] == seeds[a] != seeds[b]


def test_a_learned_connection_is_built_before_the_connection_of_its_error() -> None:
    with nengo.Network() as network:
        a, b = nengo.Ensemble(5, 1, label="a"), nengo.Ensemble(5, 1, label="b")
        with nengo.Network():
            learned = nengo.Connection(a, b, learning_rule_type=nengo.PES())
        error = nengo.Connection(b, learned.learning_rule)
        other = nengo.Connection(a, b)
    assert construction_order(network) == [other, learned, error]
