"""Violations as rows of text."""

from spikeport.compile.check.violation import DoesNotFitError, OverBudgetError, Violation

FULL = Violation("SP101", "out-axons", "core 3", "5000", "4096", "split it")
FREE = Violation("SP404", "duplicated neurons", "a", "1 of 4", "", "draw them")


def test_a_limit_is_named_where_there_is_one() -> None:
    assert str(FULL) == "core 3: SP101 out-axons: 5000, limit 4096; cure: split it"
    assert str(FREE) == "a: SP404 duplicated neurons: 1 of 4; cure: draw them"


def test_an_error_has_a_row_for_each_violation_and_where_to_learn_more() -> None:
    error = DoesNotFitError("loihi", iter([FULL, FREE]))
    assert (error.chip, error.violations) == ("loihi", (FULL, FREE))
    assert str(error).splitlines() == [
        "the network does not fit chip 'loihi':",
        f"  {FULL}",
        f"  {FREE}",
        "more: spikeport compile --explain SP101",
    ]
    assert str(OverBudgetError([FREE])).splitlines() == [
        "the network exceeds its budget:",
        f"  {FREE}",
        "more: spikeport compile --explain SP404",
    ]
