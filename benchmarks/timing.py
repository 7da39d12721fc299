"""CPU time, contestants in turn, and the memory bandwidth to compare with."""

import statistics
import time
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit

WARM_UP = 50
ROUND_S = 0.2
MOST = 2000


def cpu_us(steps: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """CPU time of a step of each contestant, in microseconds: the median of several rounds.

    They run in turn, so that whatever else the machine does meets all of them.
    """
    counts = {name: _steps_of_a_round(step) for name, step in steps.items()}
    times: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(rounds):
        for name, step in steps.items():
            times[name].append(_seconds(step, counts[name]) / counts[name] * 1e6)
    return {name: statistics.median(values) for name, values in times.items()}


def _steps_of_a_round(step: Callable[[], object]) -> int:
    """Return the number of steps that fill a round, after warming up."""
    _seconds(step, WARM_UP)
    return int(np.clip(ROUND_S / max(_seconds(step, 3) / 3, 1e-9), 3, MOST))


def _seconds(step: Callable[[], object], n: int) -> float:
    begin = time.process_time()
    for _ in range(n):
        step()
    return time.process_time() - begin


def triad_bytes_per_s(n: int = 2**24, rounds: int = 9) -> float:
    """Memory bandwidth: a = b + 3 c on arrays of n float64; 24 bytes an element, the best round.

    Source: J. D. McCalpin's STREAM, whose counting this is.
    """
    a, b, c = np.zeros((3, n))
    _triad(a, b, c)
    return 24 * n / min(_seconds(lambda: _triad(a, b, c), 1) for _ in range(rounds))


@njit
def _triad(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    for i in range(len(a)):
        a[i] = b[i] + 3.0 * c[i]
