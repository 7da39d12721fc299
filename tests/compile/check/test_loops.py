"""Hints on loops in which errors last: their gain, and the ensemble that is named."""

from collections.abc import Callable
from functools import partial

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.check.loops import MOST_DENSE, components, loop_hints
from tests.helpers.small_networks import scope_of


def hints(network: nengo.Network) -> list[tuple[str, str]]:
    return [(hint.object, hint.used) for hint in loop_hints(scope_of(network))]


def named(make: Callable[[nengo.Ensemble], object], dimensions: int = 1) -> list[tuple[str, str]]:
    with nengo.Network(seed=1) as network:
        make(nengo.Ensemble(20, dimensions, label="a"))
    return hints(network)


def fed_back(ensemble: nengo.Ensemble, **options: object) -> None:
    nengo.Connection(ensemble, ensemble, synapse=0.1, **options)


def test_objects_of_one_loop_have_the_same_component() -> None:
    number = components([("a", "b"), ("b", "a"), ("b", "c"), ("d", "d")])
    assert number["a"] == number["b"]
    assert len({number[one] for one in "acd"}) == 3
    assert components([]) == {}


@pytest.mark.parametrize(
    ("options", "gain"),
    [
        ({}, "gain 1"),
        ({"transform": 1.2}, "gain 1.2"),
        ({"function": lambda x: 0.5 + 0.97 * x}, "gain 0.97"),
        ({"function": lambda x: [0.97 * x[0]]}, "gain 0.97"),
        ({"function": np.ones((2, 1)), "eval_points": np.array([[0.0], [1.0]])}, None),
        ({"transform": 0.9}, None),
        ({"function": np.square}, None),
        ({"function": lambda x: np.full(1, np.nan)}, None),
        ({"function": lambda x: {0.0: 0.0}[x[0]]}, None),
        ({"transform": nengo.dists.Uniform(2, 3)}, None),
    ],
)
def test_the_gain_of_a_loop_is_the_gain_of_its_linear_part(
    options: dict[str, object], gain: str | None
) -> None:
    assert named(partial(fed_back, **options)) == ([("a", gain)] if gain else [])


def test_growing_oscillators_get_a_hint_but_decaying_loops_and_inhibition_do_not() -> None:
    turned = partial(fed_back, transform=[[1.05, 2], [-2, 1.05]])
    assert named(turned, dimensions=2) == [("a", "gain 1.1")]
    assert named(partial(fed_back, transform=[[0, 1], [-1, 0]]), dimensions=2) == []
    assert named(partial(fed_back, transform=-3)) == []


def test_the_gain_of_a_loop_counts_only_the_values_of_its_slices() -> None:
    def half(a: nengo.Ensemble) -> None:
        nengo.Connection(a[1], a[0])

    def swap(a: nengo.Ensemble) -> None:
        half(a)
        nengo.Connection(a[0], a[1], transform=2)

    assert named(half, dimensions=2) == []
    assert named(swap, dimensions=2) == [("a", "gain 1.4")]


def test_a_loop_through_passthrough_nodes_names_the_ensemble_of_the_largest_gain() -> None:
    with nengo.Network(seed=1) as network:
        array = nengo.networks.EnsembleArray(10, MOST_DENSE + 2, label="memory")
        gains = np.full(MOST_DENSE + 2, 0.9)
        gains[3] = 0.96
        nengo.Connection(array.output, array.input, transform=gains)
    assert hints(network) == [("memory.memory_3", "gain 0.96")]


def test_a_passthrough_node_that_feeds_itself_does_not_change_the_gain() -> None:
    with nengo.Network(seed=1) as network:
        a, node = nengo.Ensemble(10, 1, label="a"), nengo.Node(size_in=1)
        nengo.Connection(node, node, transform=0.5)
        nengo.Connection(a, node, synapse=None)
        nengo.Connection(node, a, transform=0.97)
    assert hints(network) == [("a", "gain 0.97")]


def test_loops_of_host_ensembles_learning_or_neurons_get_no_hint() -> None:
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        host, learning = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
        network.config[host].on_chip = False
        fed_back(host)
        node = nengo.Node(lambda t, x: x, size_in=1)
        nengo.Connection(learning, node)
        nengo.Connection(node, learning)
        learned = nengo.Connection(learning, learning, learning_rule_type=nengo.PES())
        nengo.Connection(node, learned.learning_rule)
        nengo.Connection(learning.neurons, learning.neurons, transform=np.eye(10))
    assert hints(network) == []


def test_functions_that_draw_random_numbers_leave_numpys_random_state_unchanged() -> None:
    def noisy(x: np.ndarray) -> np.ndarray:
        return x + np.random.normal(0, 0.01)

    with nengo.Network(seed=1) as network:
        fed_back(nengo.Ensemble(20, 1), function=noisy)
    np.random.seed(3)
    assert hints(network)
    drawn = np.random.random()
    np.random.seed(3)
    assert drawn == np.random.random()


def test_functions_of_direct_ensembles_are_not_called() -> None:
    called = []

    def integral(x: np.ndarray) -> float:
        called.append(x)
        return float(len(called))

    with nengo.Network(seed=1) as network:
        spiking, exact = nengo.Ensemble(20, 1), nengo.Ensemble(1, 1, neuron_type=nengo.Direct())
        nengo.Connection(spiking, exact)
        nengo.Connection(exact, spiking, function=integral)
    called.clear()
    assert hints(network) == []
    assert called == []
