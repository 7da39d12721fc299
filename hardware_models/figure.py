"""One figure of a chip's data sheet: a number with its unit, source and evidence."""

from functools import partial
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, model_validator

from spikeport.files import Line, Name
from spikeport.hardware_models.estimate import Estimate

# The SI unit of each unit, and the number of units in one SI unit. It is a divisor, since 10^12 is
# exact in floating point and 10^-12 is not.
UNITS = {
    "1": ("1", 1.0),
    "bit": ("bit", 1.0),
    "pJ": ("J", 1e12),
    "nJ": ("J", 1e9),
    "J": ("J", 1.0),
    "ns": ("s", 1e9),
    "us": ("s", 1e6),
    "ms": ("s", 1e3),
    "s": ("s", 1.0),
    "uW": ("W", 1e6),
    "mW": ("W", 1e3),
    "W": ("W", 1.0),
}


class StrictModel(BaseModel):
    """Base of all chip data: frozen, and it refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _known_unit(unit: str) -> str:
    if unit not in UNITS:
        raise ValueError(f"unknown unit '{unit}'; choose from: {', '.join(sorted(UNITS))}")
    return unit


MOST = 2.0**53
"""The largest count: floating point represents every whole number up to it, and so does NumPy."""

NonNegative = Annotated[float, Strict(), Field(ge=0)]


class Figure(StrictModel):
    """A number with its unit, its origin and, where known, its bounds.

    Parameters
    ----------
    value : float
        The figure, in ``unit``.
    unit : str
        One of ``UNITS``. Figures that belong to a `ChipModel` are in SI.
    source : str
        The publication or file the figure is from.
    evidence : {"code", "transcribed", "abstract", "vendor", "thread", "tool"}
        The way the source was read; ``"tool"``: a program's log, of a design of this project.
    low, high : float or None
        The bounds of the figure, in ``unit``, if known.
    note : str
        A remark that users of the figure must know.
    """

    value: NonNegative
    unit: Annotated[str, AfterValidator(_known_unit)]
    source: Name
    evidence: Literal["code", "transcribed", "abstract", "vendor", "thread", "tool"]
    low: NonNegative | None = None
    high: NonNegative | None = None
    note: Line = ""

    @model_validator(mode="after")
    def _bounds_enclose_value(self) -> "Figure":
        if self.low is not None and self.low > self.value:
            raise ValueError(f"low {self.low:g} is above value {self.value:g}")
        if self.high is not None and self.high < self.value:
            raise ValueError(f"high {self.high:g} is below value {self.value:g}")
        return self

    @property
    def estimate(self) -> Estimate:
        """The figure as an estimate, with its evidence in the source."""
        source = f"{self.source} [{self.evidence}]"
        return Estimate(self.value, self.low, self.high, self.unit, source)

    @property
    def count(self) -> int:
        """The figure as a whole number, for limits."""
        return int(self.value)


F = TypeVar("F", bound=Figure)


def in_si(unit: str, figure: F) -> F:
    """Return the figure in an SI unit.

    Raises
    ------
    ValueError
        The figure's unit is of another kind.
    """
    si_unit, per_si = UNITS[figure.unit]
    if si_unit != unit:
        raise ValueError(f"unit '{figure.unit}' does not convert to '{unit}'")
    scaled = {
        name: None if number is None else number / per_si
        for name, number in [("value", figure.value), ("low", figure.low), ("high", figure.high)]
    }
    return figure.model_copy(update={**scaled, "unit": unit})


def _whole(figure: Figure) -> Figure:
    if not (1 <= figure.value <= MOST and figure.value.is_integer()):
        raise ValueError(f"must be a whole number from 1 to 2^53, not {figure.value:g}")
    return figure


Count = Annotated[Figure, AfterValidator(partial(in_si, "1")), AfterValidator(_whole)]
Bits = Annotated[Figure, AfterValidator(partial(in_si, "bit")), AfterValidator(_whole)]
Energy = Annotated[Figure, AfterValidator(partial(in_si, "J"))]
Time = Annotated[Figure, AfterValidator(partial(in_si, "s"))]
Power = Annotated[Figure, AfterValidator(partial(in_si, "W"))]
