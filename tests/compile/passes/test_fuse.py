"""`Fuse`: ensembles that are wired alike become one."""

import nengo
import numpy as np
import pytest
from nengo_loihi.neurons import LoihiLIF

import spikeport
from spikeport.compile.check.lint import lint
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.base import NetworkPass
from spikeport.compile.passes.constant_inputs import ConstantInputs
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.split_ensembles import SplitEnsembles
from spikeport.networks.at_rest import at_rest
from spikeport.simulator import Simulator
from tests.helpers.random_networks import assert_equal_in_float, random_network, rewritten
from tests.helpers.small_networks import probed, rewrite_of


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_a_fused_network_computes_the_same_in_float(seed: int) -> None:
    network = random_network(seed)
    fused = assert_equal_in_float(network, Fuse())
    assert len(fused.network.all_ensembles) < len(network.all_ensembles)
    assert not fused.network.networks
    assert not lint(fused.scope)


def two_by_two() -> nengo.Network:
    """Return arrays of ensembles with two dimensions, whose matrices are half zeros."""
    with nengo.Network(seed=1) as network:
        network.config[nengo.Ensemble].neuron_type = LoihiLIF()  # decoded in float as on the chip
        stimulus = nengo.Node(lambda t: np.sin(20 * t + np.arange(4)))
        first, second = (nengo.networks.EnsembleArray(30, 2, ens_dimensions=2) for _ in range(2))
        nengo.Connection(stimulus, first.input)
        nengo.Connection(nengo.Node([0.2] * 4), first.input, synapse=None)
        nengo.Connection(first.output, second.input, transform=np.roll(np.eye(4), 1, 0))
        nengo.Probe(second.output)
    return network


@pytest.mark.parametrize("before", [ConstantInputs(), SplitEnsembles(max_neurons=20)])
def test_ensembles_that_a_pass_before_wired_anew_become_one(before: NetworkPass) -> None:
    network = two_by_two()
    fused = assert_equal_in_float(network, before, Fuse())
    assert len(fused.network.all_ensembles) == len(network.all_ensembles) / 2


def test_ensembles_with_sparse_transforms_become_one() -> None:
    network = two_by_two()
    first, second = network.networks
    transform = nengo.Sparse((30, 30), indices=[(0, 3), (7, 7)], init=[0.05, -0.02])
    with network:
        for pre, post in zip(first.all_ensembles, second.all_ensembles, strict=True):
            nengo.Connection(pre.neurons, post.neurons, transform=transform)
    fused = assert_equal_in_float(network, Fuse())
    assert len(fused.network.all_ensembles) == 2


@pytest.mark.slow
def test_ensembles_and_connections_that_learn_stay() -> None:
    network = random_network(3, learning=True)
    fused = assert_equal_in_float(network, Fuse())
    assert [e.label for e in fused.network.ensembles if e in network.all_ensembles] == ["pupil"]
    learned = [c for c in network.all_connections if c.learning_rule_type is not None]
    assert all(c in fused.network.connections for c in learned)


def array(**options: object) -> nengo.Network:
    with nengo.Network(seed=1, label="pair") as network:
        stimulus = nengo.Node([0.5, 0.1, -0.5], label="stimulus")
        first = nengo.networks.EnsembleArray(10, 3, label="first")
        second = nengo.networks.EnsembleArray(10, 3, label="second", **options)
        nengo.Connection(stimulus, first.input)
        nengo.Connection(first.output, second.input, synapse=0.01)
        nengo.Probe(second.output)
    return network


def test_ensembles_wired_alike_become_one() -> None:
    fused, notes = rewritten(array(), Fuse())
    assert notes == {
        "ensembles": {"before": 6, "after": 2},
        "connections": {"before": 14, "after": 5},
    }
    assert [fused.names[e] for e in fused.network.ensembles] == [
        "first.first_0 .. first.first_2",
        "second.second_0 .. second.second_2",
    ]


def test_an_ensemble_with_another_filter_is_not_fused() -> None:
    network = array()
    slow = network.networks[1].ensembles[2]
    with network:
        nengo.Connection(network.networks[0].ensembles[2], slow, synapse=0.1)
    fused, _ = rewritten(network, Fuse())
    assert [e.n_neurons for e in fused.network.ensembles] == [20, 10, 20, 10]


def test_an_ensemble_with_another_neuron_type_is_not_fused() -> None:
    network = array()
    network.networks[1].ensembles[0].neuron_type = nengo.LIF(tau_rc=0.05)
    fused, _ = rewritten(network, Fuse())
    assert [e.n_neurons for e in fused.network.ensembles] == [30, 10, 20]


def test_no_fused_ensemble_is_larger_than_max_neurons() -> None:
    fused, _ = rewritten(array(), Fuse(max_neurons=20))
    assert [e.n_neurons for e in fused.network.ensembles] == [20, 10, 20, 10]


def test_a_node_between_two_filters_stays() -> None:
    network = array()
    for ensemble in network.all_ensembles:
        # Decoders are solved for rates of the chip, and voltages would be drawn for each network.
        ensemble.neuron_type = LoihiLIF(initial_state=at_rest())
    with network:
        nengo.Connection(network.networks[1].output, network.networks[0].input, synapse=0.1)
        relay = nengo.Node(size_in=3, label="relay")
        nengo.Connection(network.networks[0].output, relay, synapse=0.1)
        nengo.Connection(relay, network.networks[1].input, synapse=0.1)
    fused = assert_equal_in_float(network, Fuse())
    assert relay in fused.network.nodes
    assert network.networks[1].input not in fused.network.all_nodes


@pytest.mark.parametrize("kind", [nengo.Direct(), nengo.Tanh(), nengo.LIF()])
def test_full_weights_of_the_host_are_decoded_there(kind: nengo.neurons.NeuronType) -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        host, chip = nengo.Ensemble(100, 1, neuron_type=kind), nengo.Ensemble(100, 1)
        network.config[host].on_chip = False
        nengo.Connection(nengo.Node(lambda t: np.sin(20 * t)), host)
        nengo.Connection(host, chip, solver=nengo.solvers.LstsqL2(weights=True))
        probe = nengo.Probe(chip, synapse=0.02)
    written, fused = probed(network, probe, "as_written", "compact")
    assert written.max() > 0.8
    np.testing.assert_allclose(fused, written, atol=0.1)


def test_the_host_sums_the_input_of_an_ensemble_that_stays() -> None:
    with nengo.Network(seed=1) as network:
        learns, hub = nengo.Ensemble(50, 1), nengo.Node(size_in=1)
        # Either input alone is beyond the radius.
        nengo.Connection(nengo.Node(lambda t: 3 + 0.8 * np.sin(12 * t)), hub, synapse=None)
        nengo.Connection(nengo.Node([-3.0]), hub, synapse=None)
        nengo.Connection(hub, learns)
        out = nengo.Node(size_in=1)
        learned = nengo.Connection(learns, out, learning_rule_type=nengo.PES(1e-5))
        nengo.Connection(out, learned.learning_rule)
        probe = nengo.Probe(learns, synapse=0.02)
    written, fused = probed(network, probe, "as_written", "compact")
    assert written.max() > 0.6
    np.testing.assert_allclose(fused, written, atol=0.2)


def test_spikes_of_the_host_are_not_encoded_as_values() -> None:
    with nengo.Network(seed=3) as network:
        spikeport.add_params(network)
        slow, ones = {"gain": np.ones(4), "bias": np.full(4, 1.02)}, np.ones((4, 1))
        host, target = nengo.Ensemble(4, 1, encoders=ones, **slow), nengo.Ensemble(100, 1)
        network.config[host].on_chip = False
        # A spike is 1000 for a step, so 12 Hz are 0.3 in mean.
        nengo.Connection(host.neurons, target, transform=np.full((1, 4), 6e-3), synapse=None)
        probe = nengo.Probe(target, synapse=0.1)
    written, fused = probed(network, probe, "as_written", "compact")
    assert written[-100:].mean() > 0.15
    np.testing.assert_allclose(fused[-100:].mean(), written[-100:].mean(), rtol=0.1)


def test_a_slow_input_from_many_neurons_keeps_its_range() -> None:
    axes = nengo.dists.Choice([[1, 0], [-1, 0], [0, 1], [0, -1]])
    with nengo.Network(seed=1) as network:
        source = nengo.Ensemble(400, 2, encoders=axes)
        integrator = nengo.Ensemble(200, 1)
        nengo.Connection(nengo.Node([0.1, -0.9]), source)
        nengo.Connection(source[1], integrator, transform=-0.1, synapse=0.1)
        nengo.Connection(integrator, integrator, synapse=0.1)
        nengo.Connection(nengo.Node(lambda t: 0), integrator)
        probe = nengo.Probe(integrator, synapse=0.02)
    written, fused = probed(network, probe, "as_written", "compact")
    assert written[-1] > 0.2
    assert fused[-1] == pytest.approx(written[-1], abs=0.05)


def test_full_weights_to_an_ensemble_that_stays_pass_through_no_relay() -> None:
    with nengo.Network(seed=2) as network:
        source, learns = nengo.Ensemble(60, 1), nengo.Ensemble(50, 1)
        nengo.Connection(nengo.Node([0.6]), source)
        solver = nengo.solvers.LstsqL2(weights=True)
        nengo.Connection(source, learns, solver=solver, synapse=0.01)
        out = nengo.Node(size_in=1)
        learned = nengo.Connection(learns, out, learning_rule_type=nengo.PES(1e-5))
        nengo.Connection(out, learned.learning_rule)
        probe = nengo.Probe(learns, synapse=0.02)
    images = [spikeport.compile_network(network, pipeline=p).image for p in ("as_written", "fuse")]
    written, fused = (sorted(block.kind for block in one.manifest.blocks) for one in images)
    assert written == fused
    written, fused = probed(network, probe, "as_written", "fuse")
    assert written[-1] > 0.4
    np.testing.assert_allclose(fused, written, atol=0.1)


def test_an_ensemble_of_a_small_radius_is_read_out() -> None:
    with nengo.Network(seed=1) as network:
        few = nengo.dists.Uniform(0.1, 0.9)
        nengo.Probe(nengo.Ensemble(30, 1, radius=3e-4, intercepts=few))
    with Simulator(network, pipeline="compact") as sim:
        assert sim.image.n_cores == 1


def test_constants_become_bias() -> None:
    biases = []
    for constant in ([0, 0, 0], [0.1, 0.2, 0.3]):
        network = array()
        with network:
            nengo.Connection(nengo.Node(constant), network.networks[1].input, synapse=None)
        ensemble = rewritten(network, Fuse())[0].network.ensembles[1]
        biases.append(ensemble.bias)
    drive = ensemble.gain * (ensemble.encoders @ [0.1, 0.2, 0.3])
    np.testing.assert_allclose(biases[1] - biases[0], drive, rtol=1e-9, atol=1e-9)


def test_read_outs_of_fused_ensembles_cannot_saturate() -> None:
    network = array()
    with network:
        scaled = nengo.Node(lambda _t, x: x, size_in=1)
        for ensemble in network.networks[1].ensembles:
            nengo.Connection(ensemble, scaled, transform=500)
    fused, _ = rewritten(network, Fuse())
    model = build(fused, 0.001).model
    (block,) = (probe.target[0] for probe in model.probes if probe.key == "voltage")
    weights = np.abs(np.vstack(block.synapses[0].weights))
    assert np.all(weights.sum(axis=0) < 64 * 2 * block.compartment.vth)


def test_built_parameters_of_the_old_ensembles_are_kept() -> None:
    network = array()
    fused, _ = rewritten(network, Fuse())
    ensemble = network.networks[0].ensembles[0]
    (decoded,) = (c for c in network.all_connections if c.pre_obj is ensemble)
    solver = ParameterSolver(rewrite_of(network), 0.001)
    np.testing.assert_array_equal(fused.built[ensemble].gain, solver.ensemble(ensemble).gain)
    np.testing.assert_array_equal(fused.built[decoded].weights, solver.weights(decoded))
