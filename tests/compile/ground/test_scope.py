"""The part of a network that is meant for the chip."""

from collections.abc import Callable
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.scope import (
    Scope,
    full_weights,
    in_full,
    is_plain,
    neurons_read,
    probeable,
    target_rows,
)


def scope_of(network: nengo.Network) -> Scope:
    return Scope(network, Names(network))


def test_ensembles_and_their_neurons_are_on_the_chip_and_nodes_are_not() -> None:
    with nengo.Network() as network:
        a, node = nengo.Ensemble(4, 2), nengo.Node(size_in=1)
    scope = scope_of(network)
    assert [scope.on_chip(obj) for obj in (a, a.neurons, a[0], a.neurons[:2])] == [True] * 4
    assert not scope.on_chip(node)
    assert scope.ensembles == [a]


def test_direct_ensembles_stay_on_the_host() -> None:
    with nengo.Network() as network:
        direct = nengo.Ensemble(1, 1, neuron_type=nengo.Direct())
        spiking = nengo.Ensemble(4, 1)
    assert scope_of(network).ensembles == [spiking]
    assert not scope_of(network).on_chip(direct)


def test_a_user_can_keep_an_ensemble_on_the_host() -> None:
    with nengo.Network() as network:
        nengo_loihi.add_params(network)
        host, chip = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1)
        network.config[host].on_chip = False
        network.config[chip].on_chip = True
    scope = scope_of(network)
    assert scope.ensembles == [chip]
    assert not scope.on_chip(host.neurons)


def test_the_ends_of_learning_stay_on_the_host() -> None:
    with nengo.Network() as network:
        pre, post, error = (nengo.Ensemble(4, 1) for _ in range(3))
        learned = nengo.Connection(pre, post, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
    assert scope_of(network).ensembles == [pre]


def test_ensembles_of_subnetworks_are_on_the_chip_too() -> None:
    with nengo.Network() as network, nengo.Network():
        inner = nengo.Ensemble(4, 1)
    assert scope_of(network).ensembles == [inner]


@pytest.mark.parametrize(
    ("part", "in_order"),
    [(slice(0, 3), True), ([0, 1, 2], True), ([2, 1, 0], False), (1, False), ([-1, 0], False)],
)
def test_decoded_connections_to_a_slice_reach_part_of_an_ensemble(
    part: Any, in_order: bool
) -> None:
    with nengo.Network() as network:
        a, b = nengo.Ensemble(4, 1), nengo.Ensemble(4, 3)
        node = nengo.Node(size_in=3)
        targets = (b[part], b, node[part])
        partly, whole, host = (nengo.Connection(a, x, function=_zeros(x.size_in)) for x in targets)
        weights = nengo.Connection(
            a, b[part], function=_zeros(b[part].size_in), solver=nengo.solvers.LstsqL2(weights=True)
        )
    scope = scope_of(network)
    found = [scope.reaches_part(c) for c in (partly, whole, host, weights)]
    assert found == [True, False, False, False]
    nengo_loihi.add_params(network)
    network.config[a].on_chip = False
    assert scope_of(network).reaches_part(weights)
    assert target_rows(partly).tolist() == np.arange(3)[[part] if part == 1 else part].tolist()
    assert in_full(partly) is in_order


def _zeros(size: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda _x: np.zeros(size)


def test_a_subclass_of_ensemble_has_the_probeable_attributes_of_ensemble() -> None:
    class Population(nengo.Ensemble):
        pass

    with nengo.Network():
        population = Population(5, 1)
    assert probeable(population) == ("decoded_output",)
    assert "output" in probeable(population.neurons)
    assert probeable(nengo.PES()) == ()


def test_only_a_weight_solver_of_an_ensembles_connection_gives_full_weights() -> None:
    with nengo.Network():
        a, b, node = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1), nengo.Node(0.5)
        solver = nengo.solvers.LstsqL2(weights=True)
        full = nengo.Connection(a, b, solver=solver)
        others = [
            nengo.Connection(a, b),
            nengo.Connection(a.neurons[:1], b),
            nengo.Connection(node, b),
        ]
    assert full_weights(full)
    assert not any(map(full_weights, others))


@pytest.mark.parametrize(
    ("kind", "plain"),
    [
        (nengo.LIF(), True),
        (nengo.RegularSpiking(nengo.LIFRate()), True),
        (nengo.RegularSpiking(nengo.Tanh()), False),
        (nengo.AdaptiveLIF(), False),
    ],
)
def test_is_plain_holds_for_neuron_types_that_nengo_loihi_builds(
    kind: nengo.neurons.NeuronType, plain: bool
) -> None:
    assert is_plain(kind) == plain


def test_a_chip_connection_that_reads_a_neuron_twice_repeats_spikes() -> None:
    with nengo.Network() as network:
        a, b = nengo.Ensemble(4, 2), nengo.Ensemble(2, 2)
        spikes = nengo.Connection(a.neurons[[1, -3]], b.neurons)
        others = [
            nengo.Connection(a.neurons[[1, 2]], b.neurons),
            nengo.Connection(a.neurons[1:3], b.neurons),
            nengo.Connection(a[[1, 1]], b),
            nengo.Connection(a.neurons[[1, 1]], nengo.Node(size_in=2)),
        ]
    scope = scope_of(network)
    assert scope.repeats_spikes(spikes)
    assert not any(map(scope.repeats_spikes, others))


@pytest.mark.parametrize(
    ("part", "read"),
    [(None, [0, 1, 2, 3]), (slice(1, 3), [1, 2]), ([3, 0], [3, 0]), (np.array([0, 2]), [0, 2])],
    ids=str,
)
def test_neurons_read_lists_the_neurons_of_a_probes_slice(part: Any, read: list[int]) -> None:
    with nengo.Network():
        neurons = nengo.Ensemble(4, 1).neurons
        probe = nengo.Probe(neurons if part is None else neurons[part])
    assert neurons_read(probe).tolist() == read


def test_an_ensemble_that_is_listed_twice_counts_once() -> None:
    with nengo.Network() as network:
        a = nengo.Ensemble(4, 1)
    network.ensembles.append(a)
    assert scope_of(network).ensembles == [a]
