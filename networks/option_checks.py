"""Checks of options of networks: counts of neurons, seeds, filters, firing rates and files."""

import os
from collections.abc import Collection
from pathlib import Path

from spikeport.constants import LARGEST_SEED
from spikeport.errors import UsageError, unknown


def check_counts(**counts: int) -> None:
    """Refuse a number of neurons below 1."""
    for key, count in counts.items():
        if count < 1:
            raise UsageError(f"{key}={count}: the number of neurons must be at least 1")


def check_pairs(key: str, count: int, what: str) -> None:
    """Refuse an odd number of neurons, or one below 2; ``what`` has half of them for each sign."""
    if count < 2 or count % 2:
        raise UsageError(
            f"{key}={count}: {what} has half its neurons for each sign; use an even number, 2 or "
            "more"
        )


def check_seed(key: str, seed: int) -> None:
    """Refuse a seed that NumPy does not accept."""
    if not 0 <= seed <= LARGEST_SEED:
        raise UsageError(f"{key}={seed}: a seed must be from 0 to {LARGEST_SEED}")


def check_filters(**time_constants_s: float) -> None:
    """Refuse a time constant that is not above 0 and below 1 s."""
    for key, tau_s in time_constants_s.items():
        if not 0 < tau_s < 1:
            raise UsageError(f"{key}={tau_s:g}: a filter must be above 0 and below 1 s")


def check_rates(**ranges_hz: tuple[float, float]) -> None:
    """Refuse a range of firing rates whose ends are not above 0, finite and in order."""
    for key, (low, high) in ranges_hz.items():
        if not 0 < low <= high < float("inf"):
            raise UsageError(
                f"{key}=({low:g}, {high:g}): firing rates in Hz must be above 0, and the lowest "
                "first"
            )


def check_name_or_file(key: str, text: str, names: Collection[str]) -> None:
    """Refuse the value of a setting that is neither a name nor the path of a file."""
    # `os.path.exists` is False, too, for a name that is too long for a file.
    if text in names or os.path.exists(text):
        return
    if Path(text).suffix or os.sep in text:
        raise UsageError(
            f"{key}={text}: no such file; cure: one of {', '.join(names)}, or the path of a file"
        )
    raise unknown(key, text, (*names, "the path of a file"))
