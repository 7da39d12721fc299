"""What the options of a policy make of its units."""

import nengo
import numpy as np
import pytest

from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError
from spikeport.networks.activations import ACTIVATIONS
from spikeport.networks.policy import (
    Calibrated,
    Layer,
    PolicyOptions,
    Ranges,
    exact,
    policy,
    record_ranges,
)
from spikeport.networks.policy_solving import by_halves, refit

STEPS = 40
"""Of an observation that is held; the actions of its second half are averaged."""
SIZES = ((6, 10), (10, 10), (10, 4))
RNG = np.random.RandomState(0)
LAYERS = [Layer(RNG.randn(n, m) * 1.2 / np.sqrt(m), 0.2 * RNG.randn(n)) for m, n in SIZES]
OBSERVATIONS = RNG.randn(600, 6)


def built(options, **more):
    ranges = record_ranges(LAYERS, OBSERVATIONS, activation_name=options.activation)
    return policy(LAYERS, ranges, options, seed=3, **more)


def float_error(options, **more):
    """Of mean actions in float, relative to how the exact ones vary."""
    shown = OBSERVATIONS[:30]
    with nengo.Network(seed=1) as network:
        net = built(options, **more)
        held = nengo.Node(nengo.processes.PresentInput(shown, STEPS * 1e-3))
        nengo.Connection(held, net.observation, synapse=None)
        probe = nengo.Probe(net.action)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(STEPS * len(shown), progress_bar=False)
        found = sim.data[probe].reshape(len(shown), STEPS, -1)[:, STEPS // 2 :].mean(axis=1)
    wanted = exact(LAYERS, shown, options.activation)[-1]
    return np.sqrt(np.mean((found - wanted) ** 2) / np.var(wanted))


def kinds(options):
    """Neuron type and membrane time constant of the halves of a unit."""
    types = [half.ensemble.neuron_type for half in built(options).layers[0].halves[:2]]
    return [(type(kind), getattr(kind, "tau_rc", None)) for kind in types]


RELU, LIF = (nengo.SpikingRectifiedLinear, None), (nengo.LIF, 0.02)


@pytest.mark.parametrize(
    ("units", "above", "below"),
    [("hybrid", RELU, LIF), ("lif", LIF, LIF), ("relu", RELU, RELU)],
)
def test_units_have_neurons_of_the_named_type(units, above, below):
    assert kinds(PolicyOptions(units=units)) == [above, below]


def test_integrate_and_fire_is_the_least_decay_the_chip_builder_takes():
    options = PolicyOptions(units="if")
    assert kinds(options) == [(nengo.LIF, 4.0)] * 2
    with nengo.Network(seed=0) as network:
        nengo.Probe(built(options).action)
    image = compile_network(network, pipeline="compact").image
    neurons = image.compartments.vth > 0
    spiking = neurons & (image.compartments.refract_delay == 2)
    assert spiking.sum() == 2 * 10 * 20
    assert set(image.compartments.decay_v[spiking]) == {1}


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("units", ["hybrid", "lif", "relu", "if"])
def test_all_variants_become_few_ensembles_on_the_chip(activation, units):
    options = PolicyOptions(activation=activation, units=units)
    with nengo.Network(seed=0) as network:
        nengo.Probe(built(options).action)
    n_halves = len(ACTIVATIONS[activation].signs)
    assert len(network.all_ensembles) == 20 * n_halves
    report = compile_network(network, pipeline="fuse,split,pack").report
    (fused,) = (one for one in report.passes if one["name"] == "fuse")
    kinds = n_halves if units == "hybrid" else 1
    assert fused["notes"]["ensembles"] == {"before": 20 * n_halves, "after": 2 * kinds}


@pytest.mark.parametrize(
    ("activation", "units", "most"),
    [
        ("elu", "hybrid", 0.06),
        ("relu", "hybrid", 0.04),
        ("tanh", "lif", 0.2),
        ("silu", "hybrid", 0.3),
        ("gelu", "hybrid", 0.3),
    ],
)
def test_float_neurons_compute_each_activation(activation, units, most):
    assert float_error(PolicyOptions(activation=activation, units=units)) < most


def test_layers_solved_for_jointly_are_nearer():
    unit = float_error(PolicyOptions(units="lif"))
    layer = float_error(PolicyOptions(units="lif", solve="layer"), observations=OBSERVATIONS)
    assert layer < 0.7 * unit


def test_solving_layers_leaves_neurons_and_decoders_of_units():
    unit, layer = (
        built(PolicyOptions(solve=solve), observations=OBSERVATIONS) for solve in ("unit", "layer")
    )
    with (
        nengo.Simulator(unit, progress_bar=False) as a,
        nengo.Simulator(layer, progress_bar=False) as b,
    ):
        for one, other in zip(unit.layers[1].halves, layer.layers[1].halves, strict=True):
            assert (a.data[one.ensemble].gain == b.data[other.ensemble].gain).all()
            assert (a.data[one.decoded].weights == b.data[other.decoded].weights).all()


def test_a_readout_by_halves_is_the_same_layer():
    options = PolicyOptions()
    actions = []
    last = by_halves(LAYERS[-1], options)
    for calibrated in (None, Calibrated(last.weights, last.bias)):
        with nengo.Network(seed=1) as network:
            net = built(options, calibrated=calibrated)
            held = nengo.Node(OBSERVATIONS[0])
            nengo.Connection(held, net.observation, synapse=None)
            probe = nengo.Probe(net.action)
        with nengo.Simulator(network, progress_bar=False) as sim:
            sim.run_steps(50, progress_bar=False)
            actions.append(sim.data[probe])
    np.testing.assert_allclose(*actions, atol=1e-12)


def test_a_trim_is_told_to_the_first_layer():
    trim = RNG.randn(6)
    last = by_halves(LAYERS[-1], PolicyOptions())
    told, *_ = exact(Calibrated(last.weights, last.bias, trim).of(LAYERS)[:1], OBSERVATIONS)
    np.testing.assert_allclose(told, exact(LAYERS, OBSERVATIONS + trim)[0], atol=1e-12)


def test_a_refit_finds_the_weights_that_values_were_made_with():
    rng = np.random.RandomState(2)
    halves, weights, bias = rng.rand(4000, 6), rng.randn(2, 6), rng.randn(2)
    nominal = by_halves(Layer(np.zeros((2, 3)), np.zeros(2)), PolicyOptions())
    found = refit(nominal, halves, halves @ weights.T + bias)
    np.testing.assert_allclose(found.weights, weights, rtol=0.01, atol=0.01)
    np.testing.assert_allclose(found.bias, bias, atol=0.01)


def test_a_refit_keeps_the_weights_of_halves_that_never_speak():
    halves = np.random.RandomState(2).rand(100, 6)
    halves[:, 4] = 0.0
    nominal = by_halves(Layer(np.array([[1.0, 2.0, 3.0]]), np.zeros(1)), PolicyOptions())
    found = refit(nominal, halves, halves.sum(axis=1, keepdims=True))
    assert found.weights[0, 4] == 2.0
    assert abs(found.weights[0, 3] - 1.0) < 0.05


def refusal(call):
    with pytest.raises(UsageError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"units": "izhikevich"}, "unknown units 'izhikevich'; there is: hybrid, if, lif, relu"),
        ({"solve": "all"}, "unknown solve 'all'; there is: layer, unit"),
        (
            {"n_neurons": 1},
            "n_neurons=1: a unit needs at least 2 neurons, one for each sign",
        ),
    ],
)
def test_options_that_mean_nothing_are_refused(option, message):
    assert refusal(lambda: PolicyOptions(**option)) == message


def test_layers_are_not_solved_without_observations():
    ranges = [Ranges(np.ones(10), np.ones(10))] * 2
    message = "solve='layer' needs recorded observations; give them to policy()"
    assert refusal(lambda: policy(LAYERS, ranges, PolicyOptions(solve="layer"))) == message
