"""The conversion of a small perceptron into spikes: figures of each layer, and hints."""

import numpy as np
import pytest

from spikeport.commands.conversion_report import lint_lines
from spikeport.experiments.policy.conversion import Conversion, convert
from spikeport.experiments.policy.lint import ConversionLint, LayerLint
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.policy import Layer, PolicyOptions


def silent(_what, _share):
    pass


def perceptron(activation):
    rng = np.random.RandomState(0)
    sizes = [(6, 4), (5, 6), (2, 5)]
    layers = [Layer(1.4 * rng.randn(n, m) / np.sqrt(m), 0.2 * rng.randn(n)) for n, m in sizes]
    return Mlp(tuple(layers), activation)


@pytest.fixture
def observations():
    return np.random.RandomState(1).randn(200, 4)


@pytest.mark.slow
@pytest.mark.filterwarnings("error:SP408")  # the report has it: ranges are quantiles
def test_a_perceptron_is_measured_layer_by_layer(observations):
    options = PolicyOptions(n_neurons=20, tau_fwd=0.004)
    conversion = Conversion(perceptron("elu"), options, observations)
    converted = convert(conversion, "loihi", "compact", silent)
    first, second = converted.lint.layers
    assert (first.name, first.n_units, first.tau_s) == ("layer 1", 6, 0.004)
    assert (second.name, second.n_units, second.tau_s) == ("layer 2", 5, options.tau_out)
    assert converted.lint.delay_s == pytest.approx(0.009)
    assert first.above == max(conversion.ranges[0].above)
    assert 0.02 < first.error < 0.3
    assert 0.02 < converted.lint.action_error < 0.3
    assert 0.02 < converted.lint.chip_error < 0.4
    assert converted.activity.n_steps == 20 * 50
    assert converted.activity.saturated_inputs
    assert converted.compilation.report.digest == converted.compilation.image.digest


def test_slow_filters_settle_before_actions_are_compared(observations):
    """Held for 50 ms, the action would be 62 % off."""
    options = PolicyOptions(n_neurons=40, tau_fwd=0.05)
    conversion = Conversion(perceptron("elu"), options, observations)
    assert conversion.steps == 4 * 55
    lint = convert(conversion, "loihi", "compact", silent).lint
    assert lint.action_error < 0.15


def test_a_layer_that_is_always_silent_has_no_relative_error(observations):
    layers = (Layer(np.zeros((3, 4)), -np.ones(3)), Layer(np.ones((2, 3)), np.zeros(2)))
    conversion = Conversion(Mlp(layers, "relu"), PolicyOptions(activation="relu"), observations)
    lint = convert(conversion, "loihi", "compact", silent).lint
    (layer,) = lint.layers
    assert (layer.error, lint.action_error, lint.chip_error) == (None, None, None)
    assert next(lint_lines(lint)) == "action: - off in float spikes, - on the chip"


def test_a_unit_at_the_end_of_its_range_is_measured_at_its_largest_rate():
    weights = np.array([[1.0]])
    layers = (Layer(weights, np.zeros(1)), Layer(weights, np.zeros(1)))
    options = PolicyOptions(n_neurons=20, max_rates=(200.0, 200.0001), activation="relu")
    conversion = Conversion(Mlp(layers, "relu"), options, np.full((10, 1), 2.0))
    (layer,) = convert(conversion, "loihi", "compact", silent).lint.layers
    assert layer.rate_hz == pytest.approx(200, rel=0.05)
    assert layer.spikes == pytest.approx(10 * options.tau_out * layer.rate_hz)
    assert (layer.below, layer.above, layer.spread) == (0.0, 2.0, 1.0)


def lint(spread=2.6, spikes=3.0, delay_s=0.009):
    layer = LayerLint("layer 1", 8, 1.0, 2.0, spread, 50.0, spikes, 0.002, 0.1)
    return ConversionLint((layer,), 0.1, 0.2, delay_s)


@pytest.mark.parametrize(
    ("found", "hint"),
    [
        (
            lint(spread=7),
            "range too wide: layer 1 (7.0 x rms); cure: record observations of the policy's own "
            "task (--observations); the error grows with the range",
        ),
        (
            lint(spikes=0.5),
            "rate too low: layer 1 (0.5 spikes within one tau); cure: more neurons (--neurons), "
            "or, except for the last layer, a longer filter (--tau-fwd)",
        ),
        (
            lint(delay_s=0.025),
            "tau too long: 25 ms in total, but an action lasts 20 ms; cure: a smaller --tau-fwd",
        ),
    ],
)
def test_a_wide_range_a_low_rate_or_a_long_filter_gives_a_hint(found, hint):
    assert list(found.hints()) == [hint]


def test_a_good_conversion_gives_no_hint():
    assert list(lint().hints()) == []
