"""Refusals of networks' options, by name, with the value and the rule."""

import pytest

from spikeport.errors import UsageError
from spikeport.networks import option_checks as check


@pytest.mark.parametrize(
    ("refused", "message"),
    [
        (lambda: check.check_counts(a=1, b=0), "b=0: the number of neurons must be at least 1"),
        (
            lambda: check.check_pairs("n", 3, "it"),
            "n=3: it has half its neurons for each sign; ",
        ),
        (
            lambda: check.check_pairs("n", 0, "it"),
            "n=0: it has half its neurons for each sign; ",
        ),
        (lambda: check.check_seed("s", -1), "s=-1: a seed must be from 0 to 4294967295"),
        (lambda: check.check_seed("s", 2**32), "s=4294967296: a seed must be from 0 to "),
        (lambda: check.check_filters(a=0.1, b=1.0), "b=1: a filter must be above 0 and below 1 s"),
        (lambda: check.check_filters(b=float("nan")), "b=nan: a filter must be above 0 and "),
        (lambda: check.check_rates(r=(0.0, 5.0)), "r=(0, 5): firing rates in Hz must be above 0"),
        (lambda: check.check_rates(r=(5.0, 4.0)), "r=(5, 4): firing rates in Hz must be above 0"),
        (
            lambda: check.check_name_or_file("k", "nix", ["a", "b"]),
            "unknown k 'nix'; choose from: a, b, the path of a file",
        ),
        (
            lambda: check.check_name_or_file("k", "nix.csv", ["a", "b"]),
            "k=nix.csv: no such file; cure: one of a, b, or the path of a file",
        ),
    ],
)
def test_an_invalid_option_is_refused_with_name_value_and_rule(refused, message):
    with pytest.raises(UsageError) as caught:
        refused()
    assert str(caught.value).startswith(message)


def test_the_bounds_themselves_are_allowed():
    check.check_counts(a=1)
    check.check_pairs("n", 2, "it")
    check.check_seed("s", 0)
    check.check_seed("s", 2**32 - 1)
    check.check_filters(a=1e-6, b=0.999)
    check.check_rates(r=(5.0, 5.0))
    check.check_name_or_file("k", "a", ["a"])
    check.check_name_or_file("k", __file__, ["a"])
