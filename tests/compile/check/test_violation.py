"""Violations as rows of text."""

from spikeport.compile.check.violation import (
    DoesNotFitError,
    OnHost,
    OverBudgetError,
    Violation,
    on_host_lines,
)

FULL = Violation("SP101", "out-axons", "core 3", "5000", "4096", "split it")
FREE = Violation("SP404", "duplicated neurons", "a", "1 of 4", "", "draw them")


def test_the_text_of_a_violation_has_a_limit_only_if_there_is_one() -> None:
    assert str(FULL) == "core 3: SP101 out-axons: 5000, limit 4096; cure: split it"
    assert str(FREE) == "a: SP404 duplicated neurons: 1 of 4; cure: draw them"


def test_an_error_has_a_row_for_each_violation_and_the_explain_command() -> None:
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


def test_violations_that_differ_only_in_object_share_a_row_in_natural_order() -> None:
    numbers = (2, 10, 1, 7, 9, 4, 3, 11, 8)
    pieces = [FULL._replace(object=f"conv[{i}/11]") for i in numbers]
    other = FULL._replace(object="conv[5/11]", used="4,100")
    error = DoesNotFitError("loihi", [FREE, *pieces, other])
    named = ", ".join(f"conv[{i}/11]" for i in (1, 2, 3, 4, 7, 8, 9, 10))
    assert str(error).splitlines()[1:-1] == [
        f"  {FULL._replace(object=f'{named} and 1 more')}",
        f"  {other}",
        f"  {FREE}",
    ]
    assert len(error.violations) == 11


def test_ensembles_on_the_host_are_named_by_reason() -> None:
    ensembles = [OnHost("post", 100, "it learns"), OnHost("x", 1, "Direct")]
    ensembles += [OnHost("err", 1000, "it learns")]
    assert on_host_lines(ensembles) == [
        "err, post (1,100 neurons): it learns",
        "x (1 neuron): Direct",
    ]
