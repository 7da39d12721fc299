"""The values of ports: commands and joined observations, checked to be as many as agreed."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from spikeport.errors import DivergedError, UsageError
from spikeport.reading.mismatch import shown

if TYPE_CHECKING:
    from spikeport.experiments.loop import Port

NUMBERS = "biuf"
"""NumPy's kinds of real numbers, with bools as 0 and 1."""


def commands(values: object, size_in: int) -> np.ndarray:
    """Return a copy of a controller's values, ``(size_in,)``, of which ports may keep parts.

    Raises
    ------
    UsageError
        If they have another shape, or are no real numbers.
    """
    found = _array(values)
    if found is None or found.dtype.kind not in NUMBERS or found.shape != (size_in,):
        raise UsageError(
            f"Loop.step() got {_named(values)} where an array of shape ({size_in},) is expected, "
            "the sum of all size_in; cure: pass the values of all ports, one after the other"
        )
    return found.astype(float)


def joined(ports: "Sequence[Port]", observed: Sequence[np.ndarray], time_s: float) -> np.ndarray:
    """Return the observations of ports, one after the other.

    Parameters
    ----------
    ports : sequence of Port
        The ports.
    observed : sequence of (port.size_out,) array
        The observation of each of them.
    time_s : float
        The time of the plant, for messages.

    Returns
    -------
    (n,) array
        The observations; n is the sum of their sizes.

    Raises
    ------
    UsageError
        If an observation does not have the shape that its port names, or is not of real numbers.
    DivergedError
        If a value of an observation is not finite.
    """
    found = _sound(ports, observed)
    if found is None:
        # There may be no fault: squares of large numbers overflow, and a list is no array.
        pairs = zip(ports, observed, strict=True)
        found = np.concatenate([_checked(port, one, time_s) for port, one in pairs])
    return found


def check_finite(what: str, values: np.ndarray, time_s: float) -> None:
    """Raise DivergedError if one of a controller's values (n,) at a time is not finite."""
    finite = np.isfinite(values)
    if np.count_nonzero(finite) < len(values):
        worst = int(np.argmin(finite))
        raise DivergedError(
            f"the controller's {what} is not finite at {time_s:.3f} s: value {worst} of "
            f"{len(values)}, counted from 0, is {values[worst]}; cure: look at its inputs in the "
            "last states"
        )


def _sound(ports: "Sequence[Port]", observed: Sequence[np.ndarray]) -> np.ndarray | None:
    """Return the concatenated observations; None if one of them seems to be wrong."""
    # A masked array is refused, too: NumPy would read its masked values as numbers.
    for port, one in zip(ports, observed, strict=True):
        if type(one) is not np.ndarray or one.shape != (port.size_out,):
            return None
    try:
        # This casting refuses complex numbers, whose imaginary parts would be dropped later.
        found = np.concatenate(observed, dtype=float, casting="same_kind")
        # NaN and infinity survive in a sum of squares, which is three times as fast as isfinite.
        is_sound = math.isfinite(found.dot(found))
    except (TypeError, ValueError):
        return None
    return found if is_sound else None


def _checked(port: "Port", value: object, time_s: float) -> np.ndarray:
    """Return an observation as an array (size_out,); refuse all but finite real numbers."""
    returned, size = f"{type(port).__name__}.observe() returned", port.size_out
    found = _array(value)
    kind = "" if found is None else found.dtype.kind
    if kind == "c":  # NumPy would drop the imaginary parts
        raise UsageError(
            f"{returned} complex numbers at {time_s:g} s, limit real ones; cure: return real and "
            "imaginary parts as values of their own"
        )
    # NumPy would convert None, times and texts to numbers, too.
    if found is None or kind not in NUMBERS or found.shape != (size,):
        raise UsageError(
            f"{returned} {_named(value)} at {time_s:g} s, expected an array of shape ({size},), as "
            "its size_out says; cure: return a flat array of that many numbers, or change size_out"
        )
    finite = np.isfinite(found)
    if not finite.all():
        worst = int(np.argmin(finite))
        raise DivergedError(
            f"{returned} {found[worst]} as value {worst} of 0 to {size - 1} at {time_s:g} s, "
            "limit finite numbers; cure: return a finite one, or look at the plant's state"
        )
    return found.astype(float)


def _array(value: object) -> np.ndarray | None:
    """Return a value as an array; None if it cannot be one, or is masked."""
    if isinstance(value, np.ma.MaskedArray):
        return None
    try:
        return np.asarray(value)
    except ValueError:  # lists of different lengths
        return None


def _named(value: object) -> str:
    """Return a wrong value in words: the shape of an array of numbers, or else the value."""
    if isinstance(value, np.ma.MaskedArray):
        return f"a masked array, {shown(value)},"
    found = _array(value)
    if found is not None and found.dtype.kind in NUMBERS:
        return f"an array of shape {found.shape}"
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype}, {shown(value)},"
    return shown(value)
