"""Observations of ports, joined; refusals name the port, its value and the time."""

import numpy as np
import pytest

from spikeport.errors import DivergedError, UsageError
from spikeport.experiments.loop import Port
from spikeport.experiments.port_values import joined


class Odd(Port):
    """A port whose observations are a test's."""

    size_out = 2

    def observe(self):
        raise AssertionError

    def drive(self, values):
        raise AssertionError


class Other(Odd):
    size_out = 1


def of_odd(value, alone=False):
    """Return the joined observations at 8 ms: a value, and a 0 of another port beside it."""
    if alone:  # it may have shapes that np.concatenate refuses beside others
        return joined([Odd()], [value], 0.008)
    return joined([Odd(), Other()], [value, np.zeros(1)], 0.008)


ALONE = pytest.mark.parametrize("alone", [True, False])


@pytest.mark.parametrize(
    ("value", "named"),
    [
        (None, "None"),
        (np.ones((2, 1)), "an array of shape (2, 1)"),
        (np.ones(3), "an array of shape (3,)"),
        (1.0, "an array of shape ()"),
        (["a", "b"], "['a', 'b']"),
        (np.array(["1", "2"]), "an array of <U1, ['1' '2'],"),
        (np.array([1, 2.5], dtype=object), "an array of object, [1 2.5],"),
        ([10**20, 0], "[100000000000000000000, 0]"),
        ([[1], [1, 2]], "[[1], [1, 2]]"),
        (np.array([1, 2], "m8[s]"), "an array of timedelta64[s], [1 2],"),
        (np.ma.array([1.0, 7.0], mask=[0, 1]), "a masked array, [1.0 --],"),
    ],
)
@ALONE
def test_an_observation_of_another_shape_or_type_is_refused_and_its_port_named(value, named, alone):
    with pytest.raises(UsageError) as caught:
        of_odd(value, alone)
    assert str(caught.value) == (
        f"Odd.observe() returned {named} at 0.008 s, expected an array of shape (2,), as its "
        "size_out says; cure: return a flat array of that many numbers, or change size_out"
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_observation_that_is_not_finite_is_refused_and_its_port_named(value):
    with pytest.raises(DivergedError) as caught:
        of_odd(np.array([1.0, value]))
    assert str(caught.value) == (
        f"Odd.observe() returned {value} as value 1 of 0 to 1 at 0.008 s, limit finite numbers; "
        "cure: return a finite one, or look at the plant's state"
    )


def test_finite_numbers_whose_squares_overflow_are_accepted():
    assert of_odd(np.array([1e200, -1e300])).tolist() == [1e200, -1e300, 0]


@pytest.mark.parametrize("value", [[3, 4], np.array([3, 4]), np.array([3.0, 4.0], np.float32)])
def test_lists_and_other_types_of_numbers_are_accepted(value):
    found = of_odd(value)
    assert found.tolist() == [3, 4, 0]
    assert found.dtype == float


@ALONE
def test_complex_observations_are_refused_and_bools_accepted_as_numbers(alone):
    assert of_odd(np.array([True, False]), alone)[:2].tolist() == [1, 0]
    with pytest.raises(UsageError) as caught:
        of_odd(np.array([1j, 0]), alone)
    assert str(caught.value) == (
        "Odd.observe() returned complex numbers at 0.008 s, limit real ones; cure: return real and "
        "imaginary parts as values of their own"
    )


def test_sizes_that_two_ports_have_swapped_are_refused():
    """Together they have as many values as they should."""
    with pytest.raises(UsageError, match=r"^Odd\.observe\(\) returned an array of shape \(1,\)"):
        joined([Odd(), Other()], [np.zeros(1), np.zeros(2)], 0.008)
