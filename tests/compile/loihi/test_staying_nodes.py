"""Passthrough nodes that stay on the host: where something learns, is probed, or sends values."""

import nengo
import numpy as np
import pytest
from nengo_loihi.passthrough import PassthroughSplit

from spikeport import Simulator, add_params
from spikeport.compile.loihi.staying_nodes import nodes_stay


def in_a_subnetwork() -> tuple[nengo.Network, nengo.Probe]:
    """Return a learner with nodes at its borders, as subnetworks have them; it learns a sine."""
    with nengo.Network(seed=1) as network:
        source = nengo.Node(lambda t: np.sin(12 * t))
        with nengo.Network(label="learner"):
            into, out, error = (nengo.Node(size_in=1) for _ in range(3))
            pre = nengo.Ensemble(50, 1)
            nengo.Connection(into, pre)
            learned = nengo.Connection(
                pre, out, function=lambda x: 0, learning_rule_type=nengo.PES(2e-4)
            )
            nengo.Connection(error, learned.learning_rule)
        post, off = nengo.Ensemble(50, 1), nengo.Ensemble(50, 1)
        nengo.Connection(source, into)
        nengo.Connection(out, post)
        nengo.Connection(post, off)
        nengo.Connection(source, off, transform=-1)
        nengo.Connection(off, error)
        probe = nengo.Probe(post, synapse=0.02)
    return network, probe


def of_arrays() -> tuple[nengo.Network, nengo.Probe]:
    """Return ensembles that each learn a value of their own into the input node of an array."""
    with nengo.Network(seed=1) as network:
        source = nengo.Node(lambda t: [np.sin(12 * t), np.cos(12 * t)])
        pre, post, off = (nengo.networks.EnsembleArray(40, 2) for _ in range(3))
        nengo.Connection(source, pre.input)
        for i, ensemble in enumerate(pre.ensembles):
            learned = nengo.Connection(
                ensemble, post.input[i], function=lambda x: 0, learning_rule_type=nengo.PES(2e-4)
            )
            nengo.Connection(off.output[i], learned.learning_rule)
        nengo.Connection(post.output, off.input)
        nengo.Connection(source, off.input, transform=-1)
        probe = nengo.Probe(post.output, synapse=0.02)
    return network, probe


@pytest.mark.slow
@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("make", [in_a_subnetwork, of_arrays])
def test_a_learned_connection_into_a_node_learns_as_in_float(make, pipeline):
    network, probe = make()
    with nengo.Simulator(network, progress_bar=False) as float_sim:
        float_sim.run(1.5)
    with Simulator(network, pipeline=pipeline, progress_bar=False) as sim:
        sim.run(1.5)
    wanted, found = float_sim.data[probe], sim.data[probe]
    off = np.linalg.norm(found - wanted) / np.linalg.norm(wanted)
    assert off < 0.5  # 1 is silence, which is decoded without learning
    assert np.linalg.norm(found[-500:]) > 2 * np.linalg.norm(found[:100])


def test_learning_succeeds_if_its_error_node_also_feeds_the_chip():
    with nengo.Network(seed=1) as network:
        a, b, m = (nengo.Ensemble(60, 1) for _ in range(3))
        out, error = nengo.Node(lambda t, x: x, size_in=1), nengo.Node(size_in=1)
        for ensemble, value in ((a, 0.5), (b, -0.5)):
            nengo.Connection(nengo.Node(value), ensemble)
        learned = nengo.Connection(a, out, function=lambda x: 0, learning_rule_type=nengo.PES(1e-3))
        nengo.Connection(b, error)
        nengo.Connection(out, error)
        nengo.Connection(error, learned.learning_rule)
        nengo.Connection(error, m)
        probes = [nengo.Probe(one, synapse=0.02) for one in (out, m)]
    with Simulator(network, progress_bar=False) as sim:
        sim.run(1.0)
    values, errors = (sim.data[probe] for probe in probes)
    assert errors[50:100].mean() < -0.2
    assert values[-200:].mean() == pytest.approx(0.5, abs=0.1)
    assert errors[-200:].mean() == pytest.approx(0, abs=0.1)


def test_rates_of_the_host_reach_the_chip_through_a_node_as_values():
    with nengo.Network(seed=1) as network:
        add_params(network)
        a, b = nengo.Ensemble(2, 1, neuron_type=nengo.LIFRate()), nengo.Ensemble(60, 1)
        network.config[a].on_chip = False
        c, node = nengo.Ensemble(60, 1), nengo.Node(size_in=1)
        nengo.Connection(nengo.Node(0.3), c)
        nengo.Connection(a.neurons, node, transform=np.full((1, 2), 0.001))
        nengo.Connection(c, node)
        nengo.Connection(node, b)
        probe = nengo.Probe(b, synapse=0.02)
    means = []
    for backend in ("native", "reference"):
        with Simulator(network, backend=backend, progress_bar=False) as sim:
            sim.run(0.5)
            means.append(sim.data[probe][-250:].mean())
    assert means[0] == pytest.approx(means[1], abs=0.1)


@pytest.mark.slow
def test_native_equals_nengo_loihi_bit_for_bit():
    network, probe = in_a_subnetwork()
    values = []
    for backend in ("native", "nengo-loihi"):
        with Simulator(network, backend=backend, progress_bar=False) as sim:
            sim.run_steps(150)
        values.append(sim.data[probe])
    np.testing.assert_array_equal(*values)


def test_nothing_of_nengo_loihi_stays_patched():
    usual = PassthroughSplit._split_cluster
    with nodes_stay():
        assert PassthroughSplit._split_cluster is not usual
    assert PassthroughSplit._split_cluster is usual


SENT = {
    # Negative spikes, whose sign the chip's spikes do not have.
    "negative": (nengo.RegularSpiking(nengo.Tanh()), np.full(20, -1.0), 1e-4),
    # Several spikes in a step, of which one would be left.
    "several": (nengo.PoissonSpiking(nengo.RectifiedLinear()), np.full(20, 400.0), 0.8 / 8000),
    "rates": (nengo.LIFRate(), np.full(20, 2.0), 0.8 / 20 / 60),
}


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
@pytest.mark.parametrize("from_chip", [False, True])
@pytest.mark.parametrize("kind", sorted(SENT))
def test_what_spikes_cannot_stand_for_reaches_the_chip_as_values(
    kind: str, from_chip: bool, pipeline: str
) -> None:
    neuron_type, bias, weight = SENT[kind]
    with nengo.Network(seed=1) as network:
        add_params(network)
        host = nengo.Ensemble(20, 1, neuron_type=neuron_type, gain=np.ones(20), bias=bias)
        network.config[host].on_chip = False
        node, target = nengo.Node(size_in=1), nengo.Ensemble(100, 1)
        nengo.Connection(host.neurons, node, transform=np.full((1, 20), weight), synapse=None)
        if from_chip:
            nengo.Connection(nengo.Ensemble(60, 1), node, transform=1e-3, synapse=None)
        nengo.Connection(node, target, synapse=0.02)
        probe = nengo.Probe(target, synapse=0.05)
    found = []
    for backend, passes in (("reference", ""), ("native", pipeline)):
        with Simulator(network, backend=backend, pipeline=passes, progress_bar=False) as sim:
            sim.run_steps(400)
            found.append(float(sim.data[probe][200:].mean()))
    assert abs(found[0]) > 0.3
    assert found[1] == pytest.approx(found[0], abs=0.07)


def test_a_connection_into_a_node_between_ensembles_on_the_chip_can_be_probed() -> None:
    with nengo.Network(seed=1) as network:
        node = nengo.Node(size_in=1)
        a, b = nengo.Ensemble(50, 1), nengo.Ensemble(50, 1)
        probed = nengo.Connection(nengo.Node(0.5), node, synapse=None)
        nengo.Connection(a, node)
        nengo.Connection(node, b, synapse=None)
        probe = nengo.Probe(probed)
    for pipeline in ("as_written", "compact"):
        with Simulator(network, pipeline=pipeline, progress_bar=False) as sim:
            sim.run_steps(10)
            assert sim.data[probe][-1] == 0.5
