"""`ConstantInputs`: constants become biases, which the host does not send."""

import nengo
import numpy as np
import pytest
from nengo_loihi.neurons import LoihiLIF

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.passes.constant_inputs import ConstantInputs
from spikeport.simulator import Simulator
from tests.helpers.random_networks import (
    assert_equal_in_float,
    float_run,
    random_network,
    rewritten,
)
from tests.helpers.same_run import context
from tests.helpers.small_networks import probed

N_STEPS = 400


def network(synapse: float | None = None, passthrough: bool = False) -> nengo.Network:
    """Return an ensemble with a changing and a constant input, and a second one that it feeds.

    Float Nengo solves the decoders of these neurons for the chip's rates, as the pass does.
    """
    with nengo.Network(seed=3, label="offset") as net:
        net.config[nengo.Ensemble].neuron_type = LoihiLIF()
        value = nengo.Node(lambda t: np.sin(6 * t), label="value")
        offset = nengo.Node([0.5, -0.25], label="offset")
        first = nengo.Ensemble(60, 2, radius=1.5, label="first")
        second = nengo.Ensemble(50, 1, label="second")
        into = nengo.Node(size_in=2, label="into") if passthrough else first
        nengo.Connection(value, into[0], synapse=None)
        nengo.Connection(offset, into, transform=[[0, 1], [1, 0]], synapse=synapse)
        if passthrough:
            nengo.Connection(into, first, synapse=None)
        nengo.Connection(first, second, function=lambda x: x[0] * x[1], synapse=0.01)
        nengo.Probe(first, synapse=0.02)
        nengo.Probe(second, synapse=0.02)
    return net


def notes_of(net: nengo.Network, **options: bool) -> dict[str, object]:
    notes: dict[str, object] = {}
    ConstantInputs(**options).apply(Rewrite(net, Names(net)), context(note=notes))
    return notes


@pytest.mark.parametrize("passthrough", [False, True])
def test_a_constant_as_a_bias_computes_the_same_in_float(passthrough: bool) -> None:
    net = network(passthrough=passthrough)
    rewritten = assert_equal_in_float(net, ConstantInputs())
    offset = next(node for node in net.nodes if node.label == "offset")
    sent = [c for c in rewritten.network.all_connections if c.pre_obj is offset]
    # A constant stays in a sum that the host makes, here that of the first dimension.
    expected = [[[0, 1 / 1.5]]] if passthrough else []
    assert [c.transform.init.tolist() for c in sent] == expected


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_networks_are_the_same_in_float(seed: int) -> None:
    assert_equal_in_float(random_network(seed), ConstantInputs(filtered=False))


def test_only_the_start_of_a_run_differs_if_the_constant_was_filtered() -> None:
    net = network(synapse=0.01)
    rewrite, _ = rewritten(net, ConstantInputs())
    before, after = (float_run(one, 100) for one in (Rewrite(net, Names(net)), rewrite))
    for probe in net.probes:
        off = np.abs(after[rewrite.stand_ins.get(probe, probe)] - before[probe])
        assert off[:40].max() > 0.07  # the filtered constant arrives late, the bias does not
        assert off[80:].max() < 0.07


def test_filtered_constants_can_be_left_as_inputs() -> None:
    assert_equal_in_float(network(synapse=0.01), ConstantInputs(filtered=False))


def test_only_changing_inputs_are_sent_to_the_chip() -> None:
    net = network()
    sent, decoded = {}, {}
    for passes in ("", "constant_inputs"):
        with Simulator(net, pipeline=passes) as sim:
            sim.run_steps(N_STEPS)
        sent[passes] = sim.activity.from_host.mean, sim.image.n_inputs
        decoded[passes] = [sim.data[probe][100:] for probe in net.probes]
    assert sent[""] == (pytest.approx(4.0, abs=0.05), 8)  # a slice is sent as a whole
    assert sent["constant_inputs"] == (pytest.approx(1.0, abs=0.05), 2)
    for before, after in zip(*decoded.values(), strict=True):
        assert np.sqrt(np.mean((after - before) ** 2)) < 0.1


@pytest.mark.parametrize(
    "pipeline",
    [
        "constant_inputs,compact",
        "sparse_inputs,constant_inputs,compact",
        "split_ensembles{max_neurons=60},fuse",
    ],
)
def test_a_second_pass_still_sends_the_sum_in_units_of_the_radius(pipeline: str) -> None:
    with nengo.Network(seed=1) as net:
        target = nengo.Ensemble(100, 1, radius=4)
        # Beyond 1, where neurons' own input is cut off.
        nengo.Connection(nengo.Node(lambda t: 3 * np.sin(12 * t)), target)
        nengo.Connection(nengo.Node([0.05]), target, synapse=None)
        probe = nengo.Probe(target, synapse=0.02)
    once, twice = probed(net, probe, "compact", pipeline)
    assert once.max() > 2.5
    np.testing.assert_allclose(twice, once, atol=0.4)


@pytest.mark.parametrize(
    "pipeline",
    [
        "constant_inputs,compact",
        "constant_inputs,fuse{max_neurons=45}",
        "constant_inputs,split_ensembles{max_neurons=45},fuse",
        "split_ensembles{max_neurons=45},fuse{max_neurons=20}",
    ],
)
def test_an_ensemble_that_only_the_first_pass_regroups_keeps_its_input(pipeline: str) -> None:
    with nengo.Network(seed=1) as net:
        first, second = nengo.Ensemble(50, 2), nengo.Ensemble(40, 2)
        constant = nengo.Node([0.1, 0.1])
        nengo.Connection(nengo.Node(lambda t: [0.7 * np.sin(12 * t), 0.5]), first)
        nengo.Connection(constant, first, synapse=None)
        nengo.Connection(constant, second, synapse=None)
        nengo.Connection(first[0], second[0])  # half of the weights of this matrix are zeros
        probe = nengo.Probe(first, synapse=0.02)
    written, regrouped = (values[100:] for values in probed(net, probe, "as_written", pipeline))
    assert np.ptp(written[:, 0]) > 0.6
    np.testing.assert_allclose(regrouped, written, atol=0.2)


@pytest.mark.parametrize("synapse", [None, 0.005])
@pytest.mark.parametrize("pipeline", ["compact", "constant_inputs,compact"])
def test_a_constant_stays_in_a_sum_of_the_host(pipeline: str, synapse: float | None) -> None:
    with nengo.Network(seed=1) as net:
        target, hub = nengo.Ensemble(100, 2, radius=2), nengo.Node(size_in=2)
        # The first alone is beyond the radius; nothing else is sent to the second dimension.
        nengo.Connection(nengo.Node(lambda t: 3.2), hub[0], synapse=None)
        nengo.Connection(nengo.Node([-2.0, 0.5]), hub, synapse=None)
        nengo.Connection(hub, target, synapse=synapse)
        probe = nengo.Probe(target, synapse=0.05)
    written, rewritten = probed(net, probe, "as_written", pipeline)
    assert written[-1] == pytest.approx([1.2, 0.5], abs=0.15)
    np.testing.assert_allclose(rewritten[-1], written[-1], atol=0.1)


def test_targets_are_noted_and_a_network_without_constants_is_unchanged() -> None:
    assert notes_of(network()) == {"targets": ["first"]}
    with nengo.Network(seed=0) as net:
        nengo.Connection(nengo.Node(np.sin), nengo.Ensemble(10, 1))
    rewrite = Rewrite(net, Names(net))
    assert ConstantInputs().apply(rewrite, context()) is rewrite


def test_functions_of_constants_stay_inputs() -> None:
    with nengo.Network(seed=0) as net:
        node, target = nengo.Node([0.5]), nengo.Ensemble(10, 1)
        nengo.Connection(node, target, function=np.square)
    assert notes_of(net) == {"targets": []}


@pytest.mark.parametrize(
    ("synapse", "passed"),
    [
        (nengo.LinearFilter([0.02, 0], [0.02, 1]), 0),
        (nengo.LinearFilter([2], [0.02, 1]), 2),
        (nengo.Alpha(0.02), 1),
    ],
)
def test_a_constant_behind_a_filter_reaches_the_neurons_as_the_filter_passes_it(
    synapse: nengo.synapses.Synapse, passed: float
) -> None:
    with nengo.Network(seed=1) as net:
        target = nengo.Ensemble(100, 1)
        nengo.Connection(nengo.Node([0.4]), target, synapse=synapse)
        probe = nengo.Probe(target, synapse=0.02)
    with Simulator(net, pipeline="constant_inputs", progress_bar=False) as sim:
        sim.run_steps(300)
        assert sim.data[probe][-50:].mean() == pytest.approx(0.4 * passed, abs=0.05)
        assert sim.image.n_inputs == (0 if passed == 1 else 2)
