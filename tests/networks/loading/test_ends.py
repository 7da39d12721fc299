"""Functions around the layers: limits, and tanh behind them."""

import numpy as np
import pytest

from spikeport.networks.loading.ends import Clip, Squash, both
from spikeport.reading.mismatch import MismatchError

X = np.linspace(-4, 4, 41)
LIMITS = Clip(np.array(-1.5), np.array(2.0))


@pytest.mark.parametrize("factor", [2.0, -0.5])
def test_limits_of_a_scaled_value_are_found_for_the_value(factor: float) -> None:
    before = LIMITS.before(np.array(factor), np.array(0.3))
    np.testing.assert_allclose(factor * before(X) + 0.3, LIMITS(factor * X + 0.3))


def test_a_hidden_value_needs_no_limits() -> None:
    with np.errstate(all="ignore"):
        before = LIMITS.before(np.array([0.0, 1.0]), np.array([2.0, 0.0]))
    assert (before.low.tolist(), before.high.tolist()) == ([-np.inf, -1.5], [np.inf, 2.0])


@pytest.mark.parametrize("factor", [2.0, -0.5, 0.0])
def test_a_clip_can_be_scaled_and_shifted_with_its_values(factor: float) -> None:
    scaled = LIMITS.scaled(np.array(factor)).shifted(np.array(0.3))
    np.testing.assert_allclose(scaled(factor * X + 0.3), factor * LIMITS(X) + 0.3)
    above = Clip(np.array(0.0), np.array(np.inf)).scaled(np.array(factor))
    np.testing.assert_allclose(above(factor * X), factor * np.maximum(X, 0))


@pytest.mark.parametrize(("low", "high"), [(-1, 1), (-3, 3), (2.5, 3), (-3, -2), (-np.inf, 0)])
def test_two_clips_are_one(low: float, high: float) -> None:
    later = Clip(np.array(low), np.array(high))
    np.testing.assert_array_equal(LIMITS.then(later)(X), later(LIMITS(X)))
    assert both(None, later, None) is later
    assert both(None) is None


def test_tanh_is_scaled_and_then_clipped() -> None:
    squash = Squash(True, np.array(2.0), np.array(1.0), LIMITS)
    np.testing.assert_array_equal(squash(X), np.minimum(1 + 2 * np.tanh(X), 2.0).clip(-1.5))
    assert squash.words == "tanh and clip"


NAN, ONE, TWO = np.array(np.nan), np.array(1.0), np.ones(2)


@pytest.mark.parametrize(
    ("end", "complaint"),
    [
        (Clip(ONE, TWO), "on 3 values, found an array of shape (2,)"),
        (Clip(np.array(-np.inf), NAN), "limits of a clip that are numbers"),
        (Clip(np.array(np.inf), np.array(np.inf)), "limits of a clip that are numbers"),
        (Squash(True, NAN, ONE, None), "NaN or infinity behind the last layer"),
        (Squash(True, ONE, TWO, None), "on 3 values, found an array of shape (2,)"),
        (Squash(False, ONE, ONE, Clip(TWO, TWO)), "on 3 values, found an array of shape (2,)"),
    ],
)
def test_ends_that_do_not_fit_are_refused(end: Clip | Squash, complaint: str) -> None:
    with pytest.raises(MismatchError) as refused:
        end.check(3)
    assert complaint in str(refused.value)
