"""Figures of a data sheet: a number with unit, source and evidence."""

import pytest
from pydantic import BaseModel, ValidationError

from spikeport.hardware_models.estimate import Estimate
from spikeport.hardware_models.figure import Count, Energy, Figure, in_si

ORIGIN = {"source": "a paper", "evidence": "vendor"}


class Sheet(BaseModel):
    """Figures of two kinds."""

    energy: Energy | None = None
    count: Count | None = None


@pytest.mark.parametrize(
    ("value", "unit", "si", "expected"),
    [(23.6, "pJ", "J", 23.6e-12), (3, "ms", "s", 0.003), (0.5, "mW", "W", 5e-4), (8, "1", "1", 8)],
)
def test_a_figure_is_converted_to_si_with_its_bounds(value, unit, si, expected):
    figure = in_si(si, Figure(value=value, unit=unit, low=value / 2, **ORIGIN))
    assert (figure.value, figure.unit) == (pytest.approx(expected, rel=1e-15, abs=0), si)
    assert (figure.low, figure.high) == (pytest.approx(expected / 2, rel=1e-15, abs=0), None)


def test_a_unit_of_another_kind_is_refused():
    with pytest.raises(ValueError, match=r"^unit 'ns' does not convert to 'J'$"):
        in_si("J", Figure(value=1, unit="ns", **ORIGIN))


def test_the_estimate_of_a_figure_has_its_bounds_and_evidence():
    figure = Figure(value=2, unit="J", low=1, high=4, **ORIGIN)
    assert figure.estimate == Estimate(2, 1, 4, "J", "a paper [vendor]")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"low": 3}, "low 3 is above value 2"),
        ({"high": 1}, "high 1 is below value 2"),
        ({"unit": "erg"}, "unknown unit 'erg'; choose from: 1, J, W"),
        ({"value": -1}, "greater than or equal to 0"),
        ({"value": float("inf")}, "finite number"),
        ({"source": ""}, "at least 1 character"),
        ({"evidence": "hearsay"}, "Input should be 'code'"),
        ({"colour": "red"}, "Extra inputs are not permitted"),
    ],
)
def test_an_invalid_figure_is_refused(change, message):
    with pytest.raises(ValidationError, match=message):
        Figure(**{"value": 2, "unit": "J", **ORIGIN, **change})


@pytest.mark.parametrize("value", [0, 1.5, 1e16])
def test_a_limit_is_a_whole_number(value):
    assert Sheet(count={"value": 3, "unit": "1", **ORIGIN}).count.count == 3
    with pytest.raises(ValidationError, match="must be a whole number from 1 to 2"):
        Sheet(count={"value": value, "unit": "1", **ORIGIN})
