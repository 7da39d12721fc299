"""A value with its interval, its unit and its source; sums and multiples keep all four."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M"}
BETWEEN_SOURCES = "; "


def plain(report: Any) -> dict[str, Any]:
    """Return a dataclass and those within it as plain data, ready for JSON: tuples become lists."""
    return asdict(report, dict_factory=_with_lists)


def _with_lists(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in pairs}


@dataclass(frozen=True)
class Estimate:
    """A physical quantity as far as it is known.

    Parameters
    ----------
    value : float
        The quantity, in SI.
    low, high : float or None
        Bounds of the quantity; None where no bound is known.
    unit : str
        An SI unit without prefix, e.g. ``"J"``.
    source : str
        The sources of the figures behind the value, separated by ``"; "``.
    """

    value: float
    low: float | None
    high: float | None
    unit: str
    source: str

    def __add__(self, other: "Estimate") -> "Estimate":
        """Return the sum of two quantities; a bound is known only where both are.

        Raises
        ------
        ValueError
            The units differ.
        """
        if self.unit != other.unit:
            raise ValueError(f"cannot add {other.unit} to {self.unit}")
        return Estimate(
            self.value + other.value,
            _add(self.low, other.low),
            _add(self.high, other.high),
            self.unit,
            merge_sources([self.source, other.source]),
        )

    def scaled(self, factor: float, unit: str | None = None) -> "Estimate":
        """Return the quantity times an exact factor, in another unit if the factor has one.

        Raises
        ------
        ValueError
            The factor is negative: nothing is counted less than zero times.
        """
        # A negative factor would swap the bounds.
        if factor < 0:
            raise ValueError(f"cannot scale an estimate by {factor}, which is negative")
        low = None if self.low is None else factor * self.low
        high = None if self.high is None else factor * self.high
        return Estimate(factor * self.value, low, high, unit or self.unit, self.source)

    def format(self, digits: int = 3) -> str:
        """Return text like ``1.23 uJ [1.08, 1.38]``, or ``[>= 1.08]`` with an unknown bound.

        ``digits`` are the significant ones, 6 at most.
        """
        exponent = _exponent(self.value, digits)
        value, low, high = (
            None if one is None else _rounded(one * 10.0**-exponent, digits)
            for one in (self.value, self.low, self.high)
        )
        return f"{value} {PREFIXES[exponent]}{self.unit} {_bounds(low, high)}"

    def to_dict(self) -> dict[str, object]:
        """Return plain data, ready for JSON."""
        return asdict(self)


def zero(unit: str) -> Estimate:
    """Return exactly zero, the start of a sum."""
    return Estimate(0.0, 0.0, 0.0, unit, "")


def at_least_zero(unit: str) -> Estimate:
    """Return an amount of unknown size: a sum that includes it has no upper bound."""
    return Estimate(0.0, 0.0, None, unit, "")


def merge_sources(sources: Iterable[str]) -> str:
    """Return every source once, in order of first mention."""
    parts = BETWEEN_SOURCES.join(sources).split(BETWEEN_SOURCES)
    return BETWEEN_SOURCES.join(dict.fromkeys(part for part in parts if part))


def _add(a: float | None, b: float | None) -> float | None:
    return None if a is None or b is None else a + b


def _exponent(value: float, digits: int) -> int:
    """Return the largest exponent with a prefix that leaves at least 1, once rounded."""
    if value == 0:
        return 0
    # Printed first: 999.9 p is written as 1 n, where a logarithm would leave 1000 p.
    decade = int(f"{abs(value):.{digits - 1}e}".split("e")[1])
    return min(max(3 * math.floor(decade / 3), min(PREFIXES)), max(PREFIXES))


def _rounded(value: float, digits: int) -> str:
    return f"{float(f'{value:.{digits}g}'):g}"


def _bounds(low: str | None, high: str | None) -> str:
    if low is not None and high is not None:
        return f"[{low}, {high}]"
    if low is not None:
        return f"[>= {low}]"
    return "[no interval]" if high is None else f"[<= {high}]"
