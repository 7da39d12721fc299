"""Functions of connections from the host, which may have a state: each step calls them once."""

import warnings
from collections.abc import Callable

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.cache import Cache
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.rewriting.called_once import called_once

STEPS = 100


class Integrator:
    """A function of a connection that has a state, and counts its calls."""

    def __init__(self) -> None:
        self.calls, self.value = 0, 0.0

    def __call__(self, x: np.ndarray) -> float:
        self.calls += 1
        self.value += 0.01 * x[0]
        return self.value


def through_a_node(function: Callable[[np.ndarray], float], direct: bool = False) -> nengo.Network:
    """Return a network in which a passthrough node leads to three targets."""
    with nengo.Network(seed=1) as network:
        source, node = nengo.Node(lambda t: 0.5), nengo.Node(size_in=1)
        if direct:
            exact = nengo.Ensemble(1, 1, neuron_type=nengo.Direct())
            nengo.Connection(source, exact, synapse=None)
            source = exact
        nengo.Connection(source, node, function=function, synapse=None)
        for radius in (1.0, 2.0):
            target = nengo.Ensemble(60, 1, radius=radius)
            nengo.Connection(node, target, synapse=None)
            nengo.Probe(target, synapse=0.01)
        nengo.Probe(node)
    return network


def beside_the_chip(function: Callable[[np.ndarray], float], direct: bool = False) -> nengo.Network:
    """Return such a network whose passthrough node also has a source on the chip."""
    network = through_a_node(function, direct)
    with network:
        nengo.Connection(nengo.Ensemble(30, 1), network.all_nodes[-1], transform=1e-6)
    return network


def into_a_large_ensemble(function: Callable[[np.ndarray], float]) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        target = nengo.Ensemble(120, 1)
        nengo.Connection(nengo.Node(lambda t: 0.5), target, function=function, synapse=None)
        nengo.Probe(target, synapse=0.01)
    return network


def run(make: Callable[..., nengo.Network], backend: str, pipeline: str, **options: bool):
    """Return the calls of a function in each step, and the values of the probes at the end.

    Nengo calls a function once as it builds, to see how many values it returns. A compile may call
    it a few times more, but at no evaluation points, of which there are hundreds.
    """
    function = Integrator()
    network = make(function, **options)
    with spikeport.Simulator(
        network, backend=backend, pipeline=pipeline, progress_bar=False
    ) as sim:
        assert function.calls < 10
        function.calls, function.value = 0, 0.0
        sim.run_steps(STEPS)
        values = [float(sim.data[probe][-1, 0]) for probe in network.all_probes]
    return function.calls / STEPS, values


SPLIT = "split_ensembles{max_neurons=50},as_written"


@pytest.mark.parametrize("make", [through_a_node, beside_the_chip, into_a_large_ensemble])
@pytest.mark.parametrize(
    ("backend", "pipeline"),
    [
        ("reference", "compact"),
        ("native", "as_written"),
        ("native", "fuse,as_written"),
        ("native", SPLIT),
        ("native", "compact"),
        ("native", "constant_inputs,as_written"),
    ],
)
def test_no_pass_lets_a_function_with_a_state_run_faster(
    make: Callable[..., nengo.Network], backend: str, pipeline: str
) -> None:
    calls, values = run(make, backend, pipeline)
    _, wanted = run(make, "reference", "")
    assert calls == 1
    # They end near 0.5, as decoded from 60 neurons; twice as many calls would add 0.5.
    assert values == pytest.approx(wanted, abs=0.15)


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_functions_of_direct_ensembles_are_called_once_too(pipeline: str) -> None:
    calls, _ = run(beside_the_chip, "native", pipeline, direct=True)
    assert calls == 1


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_connections_that_were_replaced_have_their_parameters(pipeline: str) -> None:
    network = beside_the_chip(Integrator())
    (computing,) = (c for c in network.all_connections if isinstance(c.function, Integrator))
    with spikeport.Simulator(network, pipeline=pipeline, progress_bar=False) as sim:
        assert np.ravel(sim.data[computing].weights).tolist() == [1.0]


@pytest.mark.parametrize("pipeline", [SPLIT, "compact"])
def test_the_nodes_that_compute_functions_can_be_kept(pipeline: str, tmp_path) -> None:
    def values() -> np.ndarray:
        network = through_a_node(np.square)
        kept = Cache(tmp_path / "cache")
        with spikeport.Simulator(network, pipeline=pipeline, cache=kept) as sim:
            sim.run_steps(STEPS)
            return np.hstack([sim.data[one] for one in network.all_probes])

    with warnings.catch_warnings():
        warnings.filterwarnings("error", "cache: ")  # a network that cannot be kept has one
        assert np.array_equal(values(), values())


def test_networks_without_such_functions_stay_as_they_are() -> None:
    for network in (through_a_node(np.sin), beside_the_chip(None)):
        rewrite = Rewrite(network, Names(network))
        assert called_once(rewrite, 0.001) is rewrite


def along_two_paths(function: Callable[[np.ndarray], float]) -> nengo.Network:
    """Return a network in which two paths lead through nodes to one target."""
    with nengo.Network(seed=1) as network:
        first, second = (nengo.Node(size_in=2) for _ in range(2))
        target = nengo.Ensemble(60, 2)
        nengo.Connection(nengo.Node(0.5), first[0], function=function, synapse=None)
        nengo.Connection(nengo.Ensemble(30, 1), first[1], transform=1e-6, synapse=None)
        for i in range(2):
            nengo.Connection(first[0], second[i], synapse=None)
        nengo.Connection(second, target)
        nengo.Probe(target, synapse=0.01)
    return network


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_functions_that_several_paths_lead_from_are_called_once(pipeline: str) -> None:
    calls, _ = run(along_two_paths, "native", pipeline)
    assert calls == 1
