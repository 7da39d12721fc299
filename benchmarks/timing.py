"""CPU and wall times of contestants in turn, and the bandwidth of memory to compare with."""

import statistics
import time
from collections.abc import Callable, Mapping

import numpy as np
from numba import njit

WARM_UP = 50
ROUND_S = 0.2
MOST = 2000
READ = 2**27
"""The fewest bytes to read when measuring a bandwidth."""


def cpu_us(steps: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the CPU time of a step of each contestant, in us: the median of several rounds.

    They run in turn, so that other load on the machine affects all of them.
    """
    counts = {name: _steps_of_a_round(step) for name, step in steps.items()}
    times: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(rounds):
        for name, step in steps.items():
            times[name].append(_seconds(step, counts[name]) / counts[name] * 1e6)
    return {name: statistics.median(values) for name, values in times.items()}


def wall_us(steps: Mapping[str, Callable[[], object]], n: int) -> dict[str, float]:
    """Return the wall time of a step of each contestant, in us: the 20th percentile of n steps.

    They run step by step in turn. A low percentile, as other load mostly makes steps longer.
    """
    times: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(n):
        for name, step in steps.items():
            begin = time.perf_counter()
            step()
            times[name].append(1e6 * (time.perf_counter() - begin))
    return {name: float(np.percentile(values, 20)) for name, values in times.items()}


def _steps_of_a_round(step: Callable[[], object]) -> int:
    """Return the number of steps that fill a round, after warming up."""
    _seconds(step, WARM_UP)
    return int(np.clip(ROUND_S / max(_seconds(step, 3) / 3, 1e-9), 3, MOST))


def _seconds(step: Callable[[], object], n: int) -> float:
    begin = time.process_time()
    for _ in range(n):
        step()
    return time.process_time() - begin


def read_bytes_per_s(n_bytes: int, rounds: int = 9) -> float:
    """Return the bandwidth of reading so many bytes again and again, from cache or memory.

    Eight bytes are added at a time, in order; the best round counts.
    """
    values = np.zeros(max(n_bytes // 8, 1), dtype=np.int64)
    times = -(-READ // values.nbytes)
    _read(values, 1)
    return (
        times
        * values.nbytes
        / min(_seconds(lambda: _read(values, times), 1) for _ in range(rounds))
    )


@njit
def _read(values: np.ndarray, times: int) -> int:
    total = 0
    for k in range(times):
        for i in range(len(values)):
            total += values[i] ^ k  # k: without it, LLVM would read only once
    return total
