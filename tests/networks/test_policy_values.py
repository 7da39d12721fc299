"""The values that a policy is converted from: layers, ranges, options."""

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.networks.policy_values import (
    Calibrated,
    Layer,
    PolicyOptions,
    Readout,
    exact,
    record_ranges,
)

LAYERS = [
    Layer(np.array([[1.0, -1.0], [2.0, 0.0]]), np.array([0.5, 0.0])),
    Layer(np.array([[1.0, 10.0]]), np.array([3.0])),
]


def test_layers_follow_each_other_with_an_activation_between() -> None:
    hidden, action = exact(LAYERS, np.array([1.0, 2.0]), "relu")
    assert hidden.tolist() == [-0.5, 2.0]
    assert action.tolist() == [0 + 20 + 3]


def test_many_observations_are_computed_at_once() -> None:
    observations = np.arange(12.0).reshape(2, 3, 2)
    hidden, action = exact(LAYERS, observations)
    assert (hidden.shape, action.shape) == ((2, 3, 2), (2, 3, 1))
    np.testing.assert_array_equal(hidden[1, 2], exact(LAYERS, observations[1, 2])[0])


def test_a_calibration_replaces_the_last_layer_and_trims_the_first() -> None:
    first, last = Calibrated(np.eye(2), np.ones(2), np.array([10.0, 1.0])).of(LAYERS)
    assert first.bias.tolist() == [0.5 + 10 - 1, 20.0]
    assert first.weights is LAYERS[0].weights
    assert isinstance(last, Readout)
    assert last.bias.tolist() == [1, 1]


def test_ranges_are_quantiles_of_each_sign_above_a_floor() -> None:
    layers = [Layer(np.array([[1.0], [0.1]]), np.zeros(2)), LAYERS[1]]
    observations = np.linspace(-2, 4, 101)[:, np.newaxis]
    (ranges,) = record_ranges(layers, observations, quantile=0.9, floor=0.5)
    np.testing.assert_allclose(ranges.above, [-2 + 0.9 * 6, 0.5])
    np.testing.assert_allclose(ranges.below, [-(-2 + 0.1 * 6), 0.5])


def test_a_unit_of_small_values_has_a_range_of_their_size() -> None:
    layers = [
        Layer(np.array([[0.01], [-0.001], [0.0]]), np.zeros(3)),
        Layer(np.eye(3), np.zeros(3)),
    ]
    observations = np.linspace(0, 4, 101)[:, np.newaxis]
    (ranges,) = record_ranges(layers, observations, quantile=1, floor=0.5)
    np.testing.assert_allclose(ranges.above, [1.75 * 0.04, 1.75 * 0.004, 0.5])
    np.testing.assert_allclose(ranges.below, [1.75 * 0.04, 1.75 * 0.004, 0.5])


@pytest.mark.parametrize(
    ("observations", "message"),
    [
        (np.zeros(2), r"shape \(2,\), expected \(m, 2\): a row for each"),
        (np.zeros((5, 3)), r"shape \(5, 3\), expected \(m, 2\): a row for each"),
        (np.zeros((0, 2)), r"shape \(0, 2\), expected \(m, 2\): a row for each"),
        (np.array([[0.0, np.nan]]), "observations hold NaN, infinity or no numbers; cure: leave"),
        (np.array([["a", "b"]]), "observations hold NaN, infinity or no numbers; cure: leave"),
    ],
)
def test_observations_that_ranges_cannot_be_taken_from_are_refused(
    observations: np.ndarray, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        record_ranges(LAYERS, observations)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"activation": "swish"}, "unknown activation 'swish'"),
        ({"units": "hh"}, "unknown units 'hh'; choose from: bent, hybrid, if, lif, relu"),
        ({"n_neurons": 5}, "n_neurons=5: a unit has half its neurons for each sign"),
        ({"tau_fwd": 0.0}, "tau_fwd=0: a filter must be above 0 and below 1 s"),
        ({"max_rates": (-5.0, -1.0)}, "max_rates=(-5, -1): firing rates in Hz must be above 0"),
        (
            {"n_neurons": 1},
            "n_neurons=1: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
    ],
)
def test_invalid_options_are_refused(option: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        PolicyOptions(**option)
    assert str(caught.value).startswith(message)
