"""Connections in place of passthrough nodes, which compute what float Nengo does with the nodes."""

from typing import Any

import nengo
import numpy as np
import pytest
from nengo_loihi import passthrough

import spikeport
from spikeport.compile.loihi.merged_connections import merged_in_full
from spikeport.errors import CompileError

RELU = nengo.SpikingRectifiedLinear()


def compared(network: nengo.Network, probe: nengo.Probe, pipeline: str) -> list[np.ndarray]:
    """Return the mean values of a probe on the chip and in float Nengo."""
    found = []
    for options in ({"pipeline": pipeline}, {"backend": "reference"}):
        with spikeport.Simulator(network, progress_bar=False, **options) as sim:
            sim.run(0.5)
            found.append(sim.data[probe][-250:].mean(axis=0))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_transform_with_one_factor_for_each_value_is_applied(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(200, 2), nengo.Ensemble(200, 2)
        array = nengo.networks.EnsembleArray(100, 2)
        nengo.Connection(nengo.Node([0.8, -0.6]), a)
        nengo.Connection(a, array.input, transform=[0.5, 1.5])
        nengo.Connection(array.output[[1, 0]], b, transform=[1.0, -0.5])
        probe = nengo.Probe(b, synapse=0.02)
    found, wanted = compared(network, probe, pipeline)
    assert found == pytest.approx(wanted, abs=0.15)


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("decoder", [0.0, 0.0002, 0.0004])
def test_the_solver_of_a_connection_into_a_node_is_kept(decoder: float, pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(60, 1), nengo.Ensemble(100, 1, radius=2)
        node = nengo.Node(size_in=1)
        nengo.Connection(nengo.Node(0.5), a)
        solver = nengo.solvers.NoSolver(np.full((60, 1), decoder))
        nengo.Connection(a, node, solver=solver)
        nengo.Connection(node, b)
        probe = nengo.Probe(b, synapse=0.02)
    found, wanted = compared(network, probe, pipeline)
    assert found == pytest.approx(wanted, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_probed_nodes_that_lead_nowhere_record_values(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(200, 2), nengo.Ensemble(200, 1)
        through, end, part = (nengo.Node(size_in=size) for size in (2, 2, 1))
        nengo.Connection(nengo.Node([0.8, -0.6]), a)
        nengo.Connection(a, through)
        nengo.Connection(through[0], b)
        nengo.Connection(through, end, synapse=None, transform=[[0.0, 1.0], [1.0, 0.0]])
        nengo.Connection(through[1], part, synapse=0.005)
        probes = [nengo.Probe(node, synapse=0.02) for node in (through, end, part)]
    for probe in probes:
        found, wanted = compared(network, probe, pipeline)
        assert np.abs(wanted).min() > 0.5
        assert found == pytest.approx(wanted, abs=0.05)


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_probed_sum_of_a_loop_records_values(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        array, out = nengo.networks.EnsembleArray(50, 2), nengo.Node(size_in=1)
        nengo.Connection(nengo.Node([0.3, 0.2]), array.input)
        nengo.Connection(array.output, array.input, synapse=0.1, transform=0.5)
        nengo.Connection(array.output, out, transform=[[1, 1]], synapse=None)
        probe = nengo.Probe(out, synapse=0.02)
    found, wanted = compared(network, probe, pipeline)
    assert wanted > 0.5
    assert found == pytest.approx(wanted, abs=0.1)


def test_images_do_not_depend_on_the_order_of_connections_that_differ_in_solver() -> None:
    digests = []
    for order in ((0.001, 0.004), (0.004, 0.001)):
        with nengo.Network(seed=1) as network:
            a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
            node = nengo.Node(size_in=1)
            for decoder in order:
                solver = nengo.solvers.NoSolver(np.full((20, 1), decoder))
                nengo.Connection(a, node, solver=solver)
            nengo.Connection(node, b)
        digests.append(spikeport.compile_network(network).image.digest)
    assert digests[0] == digests[1]


def spikes(through: bool, slices: Any, factor: Any, pipeline: str) -> np.ndarray:
    """Return the spikes that a connection causes, through a node or as a matrix."""
    read, into, out, reached = slices
    with nengo.Network(seed=1) as network:
        plain = {"neuron_type": RELU, "gain": np.ones(3), "encoders": np.ones((3, 1))}
        a = nengo.Ensemble(3, 1, bias=[20.0, 50.0, 90.0], **plain)
        b = nengo.Ensemble(3, 1, bias=np.zeros(3), **plain)
        if through:
            node = nengo.Node(size_in=3)
            nengo.Connection(a.neurons[read], node[into], transform=factor, synapse=None)
            nengo.Connection(node[out], b.neurons[reached], synapse=0.005)
        else:
            weights = np.zeros((3, 3))
            np.add.at(weights.T, np.arange(3)[read], factor * np.eye(3)[into])
            sent = np.zeros((3, 3))
            np.add.at(sent, np.arange(3)[reached], weights[out])
            nengo.Connection(a.neurons, b.neurons, transform=sent, synapse=0.005)
        probe = nengo.Probe(b.neurons)
    with spikeport.Simulator(network, pipeline=pipeline, progress_bar=False) as sim:
        sim.run(0.3)
        return np.array(sim.data[probe])


@pytest.mark.parametrize("factor", [1.0, 0.5])
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize(
    "slices",
    [
        (slice(None), [2, 1, 0], [1, 0, 2], slice(None)),
        (slice(None), [0, 0, 2], [2, 0, 0, 1], [0, 1, 2, 2]),
        ([0, 0, 1], slice(None), slice(None), slice(None)),
        ([2, 2, 0], [0, 2, 1], [2, 0, 1], slice(None)),
        ([2, 2, 0], [0, 0, 1], slice(None), [0, 1, 0]),
    ],
)
def test_lists_of_indices_at_a_node_give_the_same_spikes_as_a_matrix(
    slices: Any, pipeline: str, factor: float
) -> None:
    found, wanted = (spikes(through, slices, factor, pipeline) for through in (True, False))
    assert wanted.any()
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_a_value_that_is_decoded_once_may_reach_several_ensembles(pipeline: str) -> None:
    with nengo.Network(seed=1) as network:
        a, array = nengo.Ensemble(100, 2), nengo.networks.EnsembleArray(50, 3)
        nengo.Connection(nengo.Node([0.5, -0.8]), a)
        nengo.Connection(a[[1, 0, 1]], array.input, transform=[1.0, 0.5, -1.0])
        probe = nengo.Probe(array.output, synapse=0.02)
    found, wanted = compared(network, probe, pipeline)
    assert np.abs(wanted).min() > 0.2
    assert found == pytest.approx(wanted, abs=0.15)


def test_a_sparse_transform_of_entries_that_are_read_twice_is_refused() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 2), nengo.Ensemble(20, 2)
        node, sparse = nengo.Node(size_in=2), nengo.Sparse((2, 2), indices=[(0, 0), (1, 1)])
        nengo.Connection(a.neurons[[0, 0]], node, transform=sparse)
        nengo.Connection(node, b)
    with pytest.raises(CompileError, match="Mergeable transforms must be Dense"):
        spikeport.compile_network(network, pipeline="as_written")


def test_a_refusal_to_merge_names_the_node() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        first, second = nengo.Node(size_in=1, label="first"), nengo.Node(size_in=1, label="second")
        nengo.Connection(a, first, synapse=nengo.Alpha(0.01))
        nengo.Connection(first, second, synapse=None)
        nengo.Connection(second, b, synapse=0.005)
    with pytest.raises(CompileError, match=r"^first: .* before and behind it, Alpha and Lowpass"):
        spikeport.compile_network(network, pipeline="as_written")
    network.connections[0].synapse = network.connections[2].synapse = None
    network.connections[1].transform = nengo.Sparse((1, 1), indices=[(0, 0)])
    with pytest.raises(CompileError, match=r"^second: .* Mergeable transforms must be Dense"):
        spikeport.compile_network(network, pipeline="as_written")


def test_nothing_of_nengo_loihi_stays_patched() -> None:
    usual = passthrough.Cluster
    with merged_in_full(lambda _: None):
        assert passthrough.Cluster is not usual
    assert passthrough.Cluster is usual


def test_transforms_that_are_small_for_a_small_radius_alone_are_kept() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(60, 1), nengo.Ensemble(60, 1, radius=1e-9, label="b")
        node = nengo.Node(size_in=1)
        nengo.Connection(nengo.Node(0.8), a)
        nengo.Connection(a, node)
        nengo.Connection(node, b, transform=1e-9)
        probe = nengo.Probe(b, synapse=0.02)
    found, wanted = compared(network, probe, "as_written")
    assert found == pytest.approx(wanted, rel=0.15)
    assert wanted == pytest.approx([8e-10], rel=0.1)


def test_given_decoders_of_entries_that_are_read_twice_are_kept() -> None:
    with nengo.Network(seed=1) as network:
        a, b, node = nengo.Ensemble(50, 1), nengo.Ensemble(50, 2), nengo.Node(size_in=2)
        decoders = np.full((50, 2), 1e-4) * (1, 0.5)
        solver = nengo.solvers.NoSolver(decoders)
        nengo.Connection(a[[0, 0]], node, solver=solver, synapse=None)
        nengo.Connection(node, b)
        probe = nengo.Probe(b, synapse=0.05)
    found = []
    for backend in ("reference", "native"):
        with spikeport.Simulator(network, backend=backend, progress_bar=False) as sim:
            sim.run_steps(400)
            found.append(sim.data[probe][200:].mean(axis=0))
    assert found[0][0] > 0.3
    np.testing.assert_allclose(found[1], found[0], atol=0.07)
