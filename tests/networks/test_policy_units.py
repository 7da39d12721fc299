"""The units that the options of a policy make."""

import nengo
import numpy as np
import pytest

from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError
from spikeport.networks.activations import ACTIVATIONS
from spikeport.networks.policy import (
    Calibrated,
    PolicyOptions,
    Ranges,
    exact,
    policy,
)
from spikeport.networks.policy_solving import by_halves
from spikeport.networks.policy_units import bend
from spikeport.networks.policy_values import UNITS
from tests.helpers.policies import LAYERS, OBSERVATIONS, built, float_error


def kinds(options):
    """Return neuron type and membrane time constant of the halves of a unit."""
    types = [half.ensemble.neuron_type for half in built(options).layers[0].halves[:2]]
    return [(type(kind), getattr(kind, "tau_rc", None)) for kind in types]


RELU, LIF = (nengo.SpikingRectifiedLinear, None), (nengo.LIF, 0.02)


@pytest.mark.parametrize(
    ("units", "above", "below"),
    [("hybrid", RELU, LIF), ("lif", LIF, LIF), ("relu", RELU, RELU), ("bent", RELU, RELU)],
)
def test_units_have_neurons_of_the_named_type(units, above, below):
    assert kinds(PolicyOptions(units=units)) == [above, below]


def test_integrate_and_fire_units_have_the_smallest_voltage_decay_on_the_chip():
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
@pytest.mark.parametrize("units", UNITS)
def test_units_of_all_kinds_are_fused_into_few_ensembles_on_the_chip(activation, units):
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
        ("tanh", "bent", 0.1),
        ("silu", "bent", 0.06),
        ("gelu", "bent", 0.06),
        pytest.param("tanh", "lif", 0.2, marks=pytest.mark.slow),
        pytest.param("silu", "hybrid", 0.3, marks=pytest.mark.slow),
        pytest.param("gelu", "hybrid", 0.3, marks=pytest.mark.slow),
    ],
)
def test_float_neurons_compute_each_activation(activation, units, most):
    assert float_error(PolicyOptions(activation=activation, units=units)) < most


def test_a_unit_bends_where_two_lines_follow_it_best():
    z = np.linspace(0, 1, 101)
    assert bend(np.maximum(z - 0.3, 0) - 0.2 * z) == pytest.approx(0.3)
    dip = bend(ACTIVATIONS["silu"].function(-5 * z))
    assert 0.2 <= dip <= 0.35  # silu is least at z = -1.28


def test_a_trim_shifts_the_observations_of_the_first_layer():
    trim = np.random.RandomState(1).randn(6)
    last = by_halves(LAYERS[-1], PolicyOptions())
    trimmed, *_ = exact(Calibrated(last.weights, last.bias, trim).of(LAYERS)[:1], OBSERVATIONS)
    np.testing.assert_allclose(trimmed, exact(LAYERS, OBSERVATIONS + trim)[0], atol=1e-12)


def refusal(call):
    with pytest.raises(UsageError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (
            {"units": "izhikevich"},
            "unknown units 'izhikevich'; choose from: bent, hybrid, if, lif, relu",
        ),
        ({"solve": "all"}, "unknown solve 'all'; choose from: layer, unit"),
        (
            {"n_neurons": 1},
            "n_neurons=1: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
    ],
)
def test_invalid_options_are_refused(option, message):
    assert refusal(lambda: PolicyOptions(**option)) == message


def test_solving_by_layers_without_observations_is_refused():
    ranges = [Ranges(np.ones(10), np.ones(10))] * 2
    message = "solve='layer' needs recorded observations; give them to policy()"
    assert refusal(lambda: policy(LAYERS, ranges, PolicyOptions(solve="layer"))) == message
