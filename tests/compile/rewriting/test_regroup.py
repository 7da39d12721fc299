"""Ensembles in new groups, with their connections, probes, seeds and pieces."""

import nengo
import numpy as np
import pytest
from nengo.solvers import LstsqL2, LstsqNoise, Solver

from spikeport import Simulator
from spikeport.compile.ground.rewrite import Piece, Rewrite
from spikeport.compile.loihi.solver import CHIP, FLOAT, ParameterSolver
from spikeport.compile.rewriting.partition import Part, Partition
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.compile.rewriting.regroup import regroup
from tests.helpers.small_networks import (
    DT_S,
    FAST,
    SLOW,
    decode,
    decoders,
    ensemble,
    rewrite_of,
    scope_of,
    whole,
)


def regrouped(network: nengo.Network, partition: Partition, **options: object) -> Rewrite:
    folded = foldable(scope_of(network))
    return regroup(rewrite_of(network), partition, folded, DT_S, **options)


def array() -> nengo.Network:
    """Return two ensembles of 4 and 3 neurons, wired through a node to a third of 5."""
    with nengo.Network(seed=1, label="array") as network:
        network.a, network.b = ensemble("a", 4), ensemble("b", 3)
        network.c = ensemble("c", 5, 2)
        network.node = nengo.Node(size_in=2, label="node")
        decode(network.a, network.node[0], decoders(4, 1), synapse=None)
        decode(network.b, network.node[1], decoders(3, 1), synapse=None)
        nengo.Connection(network.node, network.c, synapse=FAST)
    return network


def test_members_and_nodes_are_replaced_and_the_rest_stays() -> None:
    network = array()
    with network:
        source = nengo.Node(lambda t: t, label="source")
        nengo.Connection(source, network.c[0], synapse=SLOW)
        stays = nengo.Connection(source, nengo.Node(lambda t, x: None, size_in=1, label="sink"))
        probe = nengo.Probe(source)
    flat = regrouped(network, whole((network.a, network.b))).network
    assert [e.label for e in flat.ensembles] == ["a .. b", "c"]
    assert [n.label for n in flat.nodes] == ["source", "sink"]
    assert network.c in flat.ensembles
    assert stays in flat.connections
    assert flat.probes == [probe]
    assert not flat.networks
    (into,) = [c for c in flat.connections if c.post_obj is network.c and c.pre_obj is not source]
    expected = np.zeros((2, 7))
    expected[0, :4], expected[1, 4:] = decoders(4, 1)[:, 0], decoders(3, 1)[:, 0]
    np.testing.assert_array_equal(into.transform.sample().toarray(), expected)


def test_learned_connections_stay() -> None:
    network = array()
    with network:
        learned = nengo.Connection(network.c, network.c, learning_rule_type=nengo.PES())
        error = nengo.Connection(nengo.Node([0, 0]), learned.learning_rule)
    flat = regrouped(network, whole((network.a, network.b))).network
    assert learned in flat.connections
    assert error in flat.connections


def test_a_probed_node_stays_as_a_target() -> None:
    network = array()
    with network:
        probe = nengo.Probe(network.node, synapse=FAST)
    rewrite = regrouped(network, whole((network.a, network.b)))
    assert rewrite.network.nodes[0] is network.node
    assert rewrite.network.probes == [probe]
    into = [c for c in rewrite.network.connections if c.post_obj is network.node]
    assert into
    assert not [c for c in rewrite.network.connections if c.pre_obj is network.node]


def test_the_network_and_ensembles_that_stay_keep_their_seeds() -> None:
    network = array()
    seeds = rewrite_of(network).all_seeds()
    after = regrouped(network, whole((network.a, network.b)))
    assert after.seeds[network.c] == seeds[network.c]
    assert after.seeds[after.network] == seeds[network]


def test_built_parameters_of_the_old_objects_are_kept() -> None:
    network = array()
    first, second, outward = network.connections
    solver = ParameterSolver(rewrite_of(network), DT_S)
    built = regrouped(network, whole((network.a, network.b))).built
    assert set(built) == {network.a, network.b, first, second, outward}
    np.testing.assert_array_equal(built[network.a].gain, [1, 2, 3, 4])
    np.testing.assert_array_equal(built[first].weights, solver.weights(first))


def test_connections_from_ensembles_that_stay_are_not_built() -> None:
    network = array()
    first, second, _ = network.connections
    built = regrouped(network, whole(network.c)).built
    assert not {first, second} & set(built)


def test_decoders_are_those_of_the_builder() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        connection = nengo.Connection(a, b)
    weights = {}
    for builder in (CHIP, FLOAT):
        after = regrouped(network, whole(a, b), builder=builder)
        (wired,) = after.network.connections
        weights[builder] = wired.transform.sample()
        np.testing.assert_array_equal(weights[builder], after.built[connection].weights)
    assert not np.allclose(weights[CHIP], weights[FLOAT])
    after = regrouped(network, whole(a, b))
    np.testing.assert_array_equal(after.network.connections[0].transform.sample(), weights[CHIP])


def probed(part: bool = False) -> tuple[nengo.Network, Partition]:
    """Return the array, and a partition with ``a`` after ``b`` in one group, or in two parts."""
    network = array()
    a, b = network.a, network.b
    if part:
        return network, Partition([[Part(a, 0, 2)], [Part(b, 0, 3)], [Part(a, 2, 4)]])
    return network, whole((b, a))


@pytest.mark.parametrize(
    ("read", "found"),
    [
        (slice(None), slice(3, 7)),
        (slice(1, 3), slice(4, 6)),
        ([3, 1], [6, 4]),
        (slice(None, None, 2), [3, 5]),
        (slice(None, None, -1), [6, 5, 4, 3]),
    ],
)
def test_probes_of_neurons_move_to_their_group(read: object, found: object) -> None:
    network, partition = probed()
    with network:
        probe = nengo.Probe(network.a.neurons[read], "voltage", sample_every=0.1, label="volts")
    rewrite = regrouped(network, partition)
    new = rewrite.stand_ins[probe]
    assert rewrite.network.probes == [new]
    assert new.obj == rewrite.network.ensembles[0].neurons
    assert new.slice == found
    assert (new.attr, new.sample_every, new.label) == ("voltage", 0.1, "volts")


def test_probes_of_neurons_of_one_part_move_to_its_group() -> None:
    network, partition = probed(part=True)
    with network:
        probe = nengo.Probe(network.a.neurons[3])
    rewrite = regrouped(network, partition)
    new = rewrite.stand_ins[probe]
    assert new.obj == rewrite.network.ensembles[2].neurons
    assert new.slice == slice(1, 2)


def decoders_of(network: nengo.Network, probe: nengo.Probe) -> np.ndarray:
    """Return the decoders (n, d) of a probe; Nengo solves them with the probe's seed."""
    node = nengo.Node(size_in=probe.size_in, add_to_container=False)
    read = nengo.Connection(probe.target, node, solver=probe.solver, add_to_container=False)
    solver = ParameterSolver(rewrite_of(network), DT_S)
    solver.seeds[read] = solver.seeds[probe]
    return solver.weights(read).T


@pytest.mark.parametrize("solver", [LstsqL2(), LstsqNoise()])
def test_probes_of_values_decode_only_their_ensemble(solver: Solver) -> None:
    network, partition = probed()
    with network:
        probe = nengo.Probe(network.a, synapse=SLOW, solver=solver)
    rewrite = regrouped(network, partition)
    new = rewrite.stand_ins[probe]
    assert new.obj is rewrite.network.ensembles[0]
    assert new.synapse == SLOW
    np.testing.assert_array_equal(new.solver.values[:3], 0)
    np.testing.assert_array_equal(new.solver.values[3:], decoders_of(network, probe))
    assert np.abs(new.solver.values).max() > 0
    assert not rewrite.network.nodes


def test_probes_of_some_dimensions_decode_only_these() -> None:
    network = array()
    with network:
        probe = nengo.Probe(network.c[1])
    new = regrouped(network, whole(network.c)).stand_ins[probe]
    np.testing.assert_array_equal(new.solver.values, decoders_of(network, probe))


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_probe_may_read_a_dimension_several_times(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(50, 2)
        nengo.Connection(nengo.Node([0.5, -0.3]), a)
        once, twice = nengo.Probe(a[[1, 0]], synapse=0.1), nengo.Probe(a[[1, 1, 0]], synapse=0.1)
    with Simulator(network, pipeline=pipeline) as sim:
        sim.run_steps(100)
        expected = sim.data[once][:, [0, 0, 1]]
        np.testing.assert_allclose(sim.data[twice], expected, atol=0.02)
        assert abs(expected).max() > 0.1


def test_probes_of_values_of_several_parts_are_summed_on_the_host() -> None:
    network, partition = probed(part=True)
    with network:
        probe = nengo.Probe(network.a, synapse=SLOW, label="value")
    rewrite = regrouped(network, partition)
    new = rewrite.stand_ins[probe]
    assert isinstance(new.obj, nengo.Node)
    assert new.obj in rewrite.network.nodes
    assert new.synapse == SLOW
    into = [c for c in rewrite.network.connections if c.post_obj is new.obj]
    first, _, second, _ = rewrite.network.ensembles
    decoded = [c.pre_obj.label for c in into]
    assert decoded == [f"{first.label} output", f"{second.label} output"]


def test_only_a_group_of_one_part_of_an_ensemble_is_a_piece() -> None:
    network = array()
    a, b, c = network.a, network.b, network.c
    groups = [[Part(a, 0, 2)], [Part(a, 2, 4)], [Part(b, 0, 1)], [Part(c, 0, 5), Part(b, 1, 3)]]
    first = regrouped(network, Partition(groups))
    assert list(first.pieces.values()) == [Piece("a", 0, 2), Piece("a", 1, 2), Piece("b", 0, 2)]
    assert list(first.pieces) == first.network.ensembles[:3]
    front, back, rest, _ = first.network.ensembles
    again = regroup(first, whole(front, (back, rest)), [], DT_S)
    alone = again.network.ensembles[0]
    assert again.pieces == {alone: Piece("a", 0, 2)}
    assert alone not in first.network.ensembles


def test_members_of_a_group_are_named_after_the_users_ensembles() -> None:
    network = array()
    a, b, c = network.ensembles
    first = regrouped(network, Partition([[Part(a, 0, 2)], [Part(a, 2, 4)], [Part(b, 0, 3)]]))
    assert first.members == {}
    one, other, rest, _ = first.network.ensembles
    second = regroup(first, whole((one, other), (rest, c)), [], DT_S)
    assert second.members == {"a[1/2] .. a[2/2]": ("a",), "b .. c": ("b", "c")}
    third = regroup(second, whole(tuple(second.network.ensembles)), [], DT_S)
    assert ("a", "b", "c") in third.members.values()


def test_pieces_that_stay_remain_pieces() -> None:
    network = array()
    first = regrouped(network, Partition([[Part(network.a, 0, 2)], [Part(network.a, 2, 4)]]))
    again = regroup(first, whole(network.c), [], DT_S)
    assert again.pieces == first.pieces
    assert set(again.pieces) < set(again.network.ensembles)
