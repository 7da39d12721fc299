"""Intervals of 95 % confidence: Wilson's for shares, Student's for means."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An estimate with its interval; bounds are None where there is a single value."""

    estimate: float
    low: float | None
    high: float | None
    n: int


def of_share(hits: int, n: int) -> Interval | None:
    """Return the share of hits with Wilson's score interval; None if ``n`` is 0."""
    if n == 0:
        return None
    test = stats.binomtest(hits, n)
    low, high = test.proportion_ci(CONFIDENCE, method="wilson")
    return Interval(hits / n, float(low), float(high), n)


def of_mean(values: Sequence[float]) -> Interval | None:
    """Return the mean of values with Student's interval; None without values."""
    n = len(values)
    if n == 0:
        return None
    mean = float(np.mean(values))
    if n == 1:
        return Interval(mean, None, None, n)
    # Two-sided: half of the remaining probability lies beyond each end.
    half = stats.t.ppf((1 + CONFIDENCE) / 2, n - 1) * stats.sem(values)
    return Interval(mean, float(mean - half), float(mean + half), n)
