import pytest

from spikeport.hardware_models.estimate import Estimate, at_least_zero, zero

a = Estimate(2.0, 1.0, 4.0, "J", "a [code]")
b = Estimate(10.0, 9.0, None, "J", "b [vendor]; a [code]")


def test_sum_adds_bounds_and_merges_sources():
    assert a + a == Estimate(4.0, 2.0, 8.0, "J", "a [code]")
    assert a + b == Estimate(12.0, 10.0, None, "J", "a [code]; b [vendor]")


def test_an_unknown_bound_is_unknown_in_every_sum_and_multiple():
    no_low = Estimate(1.0, None, 2.0, "J", "c")
    assert (a + no_low).low is None
    assert (a + no_low).high == 6.0
    assert no_low.scaled(3.0) == Estimate(3.0, None, 6.0, "J", "c")


def test_zero_changes_nothing_and_an_unknown_share_removes_the_upper_bound():
    assert zero("J") + a == a
    assert a + at_least_zero("J") == Estimate(2.0, 1.0, None, "J", "a [code]")


def test_scaling_can_change_the_unit():
    assert a.scaled(2.0, unit="W") == Estimate(4.0, 2.0, 8.0, "W", "a [code]")


def test_a_sum_of_different_units_is_refused():
    with pytest.raises(ValueError, match=r"^cannot add W to J$"):
        a + zero("W")


def test_negative_factors_are_refused():
    with pytest.raises(ValueError, match=r"^cannot scale an estimate by -1, which is negative$"):
        a.scaled(-1)


@pytest.mark.parametrize(
    ("value", "low", "high", "text"),
    [
        (1.23e-6, 1.08e-6, 1.38e-6, "1.23 uJ [1.08, 1.38]"),
        (1.23e-6, 1.23e-6, None, "1.23 uJ [>= 1.23]"),
        (1.23e-6, None, 2e-6, "1.23 uJ [<= 2]"),
        (0.104, None, None, "104 mJ [no interval]"),
        (23.6e-12, 23.6e-12, 1.2e-9, "23.6 pJ [23.6, 1200]"),
        (999.6e-9, 999.4e-9, 1e-6, "1 uJ [0.999, 1]"),
        (1.0, 0.0, 1.0, "1 J [0, 1]"),
        (0.0, 0.0, None, "0 J [>= 0]"),
        (5e-18, None, None, "0.005 fJ [no interval]"),
        (4.5e10, None, None, "45000 MJ [no interval]"),
    ],
)
def test_an_estimate_is_written_with_a_prefix_of_its_unit_and_its_bounds(value, low, high, text):
    assert Estimate(value, low, high, "J", "").format() == text


def test_an_estimate_is_written_with_more_digits_on_request():
    assert Estimate(999.96e-9, 999.4e-9, None, "J", "").format(6) == "999.96 nJ [>= 999.4]"
    assert Estimate(0.1040187, 0.0, 0.11, "W", "").format(6) == "104.019 mW [0, 110]"


def test_to_dict_is_plain():
    assert b.to_dict() == {
        "value": 10.0,
        "low": 9.0,
        "high": None,
        "unit": "J",
        "source": "b [vendor]; a [code]",
    }
