"""`SparseInputs`: the host sends the same values with fewer spikes."""

import dataclasses

import nengo
import numpy as np
import pytest

from spikeport import add_params
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.sparse_inputs import SparseInputs
from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError
from spikeport.simulator import Simulator
from tests.helpers.same_run import context

VALUES = (0.5, -0.25)
RADIUS = 2.0
N_STEPS = 500


def network(to_neurons: bool = False) -> nengo.Network:
    """Return a node whose values go to the encoders or to the neurons of an ensemble."""
    with nengo.Network(seed=1) as net:
        values = nengo.Node(lambda _t: RADIUS * np.array(VALUES), label="values")
        encoders = np.repeat([[1, 0], [-1, 0], [0, 1], [0, -1]], 30, axis=0)
        net.neurons = nengo.Ensemble(120, 2, encoders=encoders, radius=RADIUS)
        if to_neurons:
            matrix = encoders / RADIUS
            nengo.Connection(values, net.neurons.neurons, transform=matrix, synapse=None)
        else:
            nengo.Connection(values, net.neurons, synapse=None)
        net.decoded = nengo.Probe(net.neurons, synapse=0.02)
    return net


def ran(net: nengo.Network, passes: str, backend: str = "native") -> Simulator:
    with Simulator(net, backend=backend, pipeline=passes) as sim:
        sim.run_steps(N_STEPS)
    return sim


def test_the_pass_changes_only_the_weight_of_inputs():
    net = network()
    rewrite = Rewrite(net, Names(net))
    after = SparseInputs(weight=3).apply(rewrite, context())
    assert after == dataclasses.replace(rewrite, input_weight=3)
    assert after.then(net, {}).input_weight == 3  # also when passes follow


@pytest.mark.parametrize("to_neurons", [False, True])
@pytest.mark.parametrize("weight", [1, 2, 4])
def test_the_same_values_arrive_with_fewer_spikes(weight, to_neurons):
    net = network(to_neurons)
    usual, sparse = ran(net, ""), ran(net, f"sparse_inputs{{weight={weight}}}")
    means = [sim.data[net.decoded][N_STEPS // 5 :].mean(axis=0) for sim in (usual, sparse)]
    np.testing.assert_allclose(*means, atol=0.05 * RADIUS)
    assert usual.activity.from_host.mean == pytest.approx(2.0, abs=0.01)
    sent = RADIUS if to_neurons else 1.0  # neurons have no radius: values are sent as they are
    wanted = sent * np.abs(VALUES).sum() / weight
    assert sparse.activity.from_host.mean == pytest.approx(wanted, abs=0.02)


def test_neurons_that_stay_on_the_host_get_their_values_as_before():
    with nengo.Network(seed=1) as net:
        add_params(net)
        relay = nengo.Ensemble(5, 1, neuron_type=nengo.SpikingRectifiedLinear())
        net.config[relay].on_chip = False
        nengo.Connection(nengo.Node([0.5] * 5), relay.neurons, synapse=None)
        nengo.Connection(relay.neurons, nengo.Ensemble(5, 1).neurons)
        net.sent = nengo.Probe(relay.neurons)
    sent = [ran(net, passes).data[net.sent] for passes in ("", "sparse_inputs")]
    assert sent[0].any()
    np.testing.assert_array_equal(*sent)


def test_the_pass_does_not_change_a_run_in_float():
    net = network()
    runs = [ran(net, passes, "reference") for passes in ("", "sparse_inputs")]
    first, second = (sim.data[net.decoded] for sim in runs)
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("passes", ["sparse_inputs,as_written", "sparse_inputs,compact"])
def test_native_and_emulator_agree_bit_for_bit(passes):
    net = network()
    first, second = (ran(net, passes, backend) for backend in ("native", "nengo-loihi"))
    np.testing.assert_array_equal(first.data[net.decoded], second.data[net.decoded])
    assert first.activity.totals() == second.activity.totals()


@pytest.mark.slow
@pytest.mark.parametrize("weight", [1, 2])
def test_values_of_one_sign_have_no_larger_error(weight):
    """Compare decoded values of many neurons, whose own noise is small beside the input's."""
    with nengo.Network(seed=0) as net:
        value = nengo.Node(lambda t: 0.5 + 0.4 * np.sin(20 * t))
        target = nengo.Ensemble(1000, 1, neuron_type=nengo.SpikingRectifiedLinear())
        nengo.Connection(value, target, synapse=None)
        net.decoded = nengo.Probe(target, synapse=0.005)
    with Simulator(net, backend="reference") as sim:
        sim.run_steps(N_STEPS)
        wanted = sim.data[net.decoded]

    def error(passes: str) -> float:
        apart = ran(net, passes).data[net.decoded] - wanted
        return float(np.sqrt(np.mean(apart[100:] ** 2)))

    assert error(f"sparse_inputs{{weight={weight}}}") < 1.05 * error("")


def test_with_a_weight_of_1_only_the_encoding_differs():
    net = network()
    usual, sparse = (
        compile_network(net, pipeline=passes).image for passes in ("", "sparse_inputs{weight=1}")
    )
    same = dataclasses.replace(sparse.manifest, inputs=usual.manifest.inputs)
    assert dataclasses.replace(sparse, manifest=same).digest == usual.digest
    entry, other = usual.manifest.inputs[0], sparse.manifest.inputs[0]
    assert (entry.encoding.gain, entry.encoding.bias) == (500, 500)
    assert other == dataclasses.replace(
        entry, encoding=dataclasses.replace(entry.encoding, gain=1000, bias=0)
    )


@pytest.mark.parametrize("weight", ["0.5", "nan", "inf", "1000"])
def test_a_weight_outside_1_to_100_is_refused(weight):
    with pytest.raises(UsageError, match="weight"):
        parse(f"sparse_inputs{{weight={weight}}}")
