"""Counts, sizes and shares, in words."""

from spikeport.constants import BITS_PER_KIB


def counted(n: float, noun: str) -> str:
    """Return a number with its noun, such as "1 core" or "2,306 synapses"."""
    return f"{n:,} {noun}{'s' * (n != 1)}"


def in_kib(n_bits: int) -> str:
    """Return the size of a memory in whole KiB, "<1" where it would round to 0, without its unit.

    Examples
    --------
    >>> in_kib(12_736), in_kib(3_000), in_kib(0)
    ('2', '<1', '0')
    """
    rounded = f"{n_bits / BITS_PER_KIB:,.0f}"
    return "<1" if rounded == "0" and n_bits else rounded


def percent(share: float | None) -> str:
    """Return a share or a relative error in percent, with two digits, and "-" for None.

    Examples
    --------
    >>> percent(0.0053), percent(0.12), percent(2.46), percent(None)
    ('0.53 %', '12 %', '246 %', '-')
    """
    if share is None:
        return "-"
    value = 100 * share
    # From 100 on, two digits would have an exponent.
    return f"{value:,.0f} %" if value >= 99.5 else f"{value:.2g} %"
