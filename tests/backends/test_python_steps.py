"""Nodes against Nengo's: their return values, their input, and refusals."""

from collections.abc import Callable
from typing import Any

import nengo
import numpy as np
import pytest
from nengo.exceptions import SimulationError

import spikeport

STEPS = 5


def network_with(output: Callable[..., Any], size_out: int) -> nengo.Network:
    with nengo.Network(seed=0) as network:
        source = nengo.Node([0.25, -0.5])
        node = nengo.Node(output, size_in=2, size_out=size_out)
        nengo.Connection(source, node, synapse=None)
        nengo.Ensemble(5, 1)  # for the chip
        network.probe = nengo.Probe(node)
    return network


def in_nengo(network: nengo.Network) -> np.ndarray:
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(STEPS)
        return sim.data[network.probe]


def in_spikeport(network: nengo.Network) -> np.ndarray:
    with spikeport.Simulator(network) as sim:
        sim.run_steps(STEPS)
        return sim.data[network.probe]


@pytest.mark.parametrize(
    "output",
    [
        lambda t, x: x * t,
        lambda t, x: [t, x[1]],
        lambda t, x: (x[0] > 0, t > 0.003),
        lambda t, x: x > 0,
        lambda t, x: np.array([1, 2]),
        lambda t, x: np.array([t], dtype=np.float32),
        lambda t, x: np.array([1e308, 1e308]),
        lambda t, x: t,
    ],
)
def test_return_values_of_a_node_are_kept_as_in_nengo(output: Callable[..., Any]) -> None:
    network = network_with(output, size_out=2)
    values = in_spikeport(network)
    assert np.array_equal(values, in_nengo(network))
    assert np.any(values != 0)


def test_a_product_equals_nengos_whether_or_not_its_vector_changes() -> None:
    rng = np.random.RandomState(0)
    with nengo.Network(seed=0) as network:
        source = nengo.Node(lambda t: np.sin(np.floor(t / 0.002 + 0.5) * np.arange(1, 40)))
        node = nengo.Node(size_in=7)
        nengo.Connection(source, node, transform=rng.randn(7, 39), synapse=None)
        nengo.Ensemble(5, 1)  # for the chip
        network.probe = nengo.Probe(node)
    values = in_spikeport(network)
    assert np.array_equal(values, in_nengo(network))
    assert 1 < len(np.unique(values, axis=0)) < STEPS


@pytest.mark.parametrize(
    "returned",
    [
        None,
        [1.0, None],
        np.array([np.nan, 1.0]),
        np.array([np.inf, -np.inf]),
        np.array([1.0, 2.0, 3.0]),
        np.array(["a", "b"]),
        np.array([None, 1.0]),
        "text",
    ],
)
def test_return_values_that_nengo_refuses_are_refused_in_its_words(returned: Any) -> None:
    # Nengo calls a node's function when the node is made; this one goes wrong later.
    network = network_with(lambda t, x: x if t < 0.003 else returned, size_out=2)
    with pytest.raises(SimulationError) as expected:
        in_nengo(network)
    with pytest.raises(SimulationError) as raised:
        in_spikeport(network)
    assert str(raised.value) == str(expected.value)


def test_a_node_may_change_and_keep_its_input_array() -> None:
    seen = []

    def output(_t: float, x: np.ndarray) -> np.ndarray:
        x += 1
        seen.append(x)
        return x

    values = in_spikeport(network_with(output, size_out=2))
    assert np.array_equal(values, np.tile([1.25, 0.5], (STEPS, 1)))
    assert np.array_equal(seen[-STEPS:], values)


def test_a_node_without_output_is_called_each_step() -> None:
    times = []
    with nengo.Network(seed=0) as network:
        nengo.Ensemble(5, 1)
        nengo.Node(lambda t: times.append(t), size_in=0, size_out=0)
    times.clear()
    with spikeport.Simulator(network) as sim:
        sim.run_steps(STEPS)
    assert times == [0.001 * (i + 1) for i in range(STEPS)]
