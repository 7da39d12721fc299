"""`Fuse`: ensembles that are wired alike become one."""

import nengo
import numpy as np
import pytest

from spikeport.compile.check.lint import lint
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.solver import ParameterSolver
from spikeport.compile.passes.fuse import Fuse
from tests.helpers.random_networks import assert_equal_in_float, random_network, rewritten
from tests.helpers.small_networks import rewrite_of


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_a_fused_network_computes_the_same_in_float(seed: int) -> None:
    network = random_network(seed)
    fused = assert_equal_in_float(network, Fuse())
    assert len(fused.network.all_ensembles) < len(network.all_ensembles)
    assert not fused.network.networks
    assert not lint(fused.scope)


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


def test_nodes_on_a_path_with_two_filters_stay() -> None:
    network = array()
    with network:
        nengo.Connection(network.networks[1].output, network.networks[0].input, synapse=0.1)
        relay = nengo.Node(size_in=3, label="relay")
        nengo.Connection(network.networks[0].output, relay, synapse=0.1)
        nengo.Connection(relay, network.networks[1].input, synapse=0.1)
    fused = assert_equal_in_float(network, Fuse())
    assert relay in fused.network.nodes


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
