"""The networks that all contestants run, as arrays; imports only NumPy, which all of them have.

Neurons integrate and fire, without a leak: v <- v + bias + sum of w over the neurons that spiked in
the step before. A neuron spikes if v > vth, and v = 0 then. Numbers are integers, so that sums are
exact even in floats of 32 bits, and every simulator has the same spikes.
"""

import json
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

WARM_UP = 20
"""Steps before the clock starts, during which just-in-time compilers finish."""
COUNTED = 100
"""Steps whose spikes are counted, the same ones in all simulators."""
LONG_S, SHARE = 2.0, 10
"""A long run takes this CPU time or more, and a short one has a tenth of its steps."""
ROUNDS = 3


class Traffic(NamedTuple):
    """A network of n neurons with m weights.

    Attributes
    ----------
    start : (n + 1,) array
        The index at which each neuron's weights begin.
    target, weight : (m,) arrays
        The postsynaptic neuron of each weight, and the weight.
    bias, vth : (n,) arrays
        Drive of a step and threshold.
    """

    start: np.ndarray
    target: np.ndarray
    weight: np.ndarray
    bias: np.ndarray
    vth: np.ndarray

    @property
    def n(self) -> int:
        """Number of neurons."""
        return len(self.bias)

    @property
    def fan_out(self) -> np.ndarray:
        """Number of weights of each neuron, (n,)."""
        return np.diff(self.start)

    @property
    def source(self) -> np.ndarray:
        """The presynaptic neuron of each weight, (m,)."""
        return np.repeat(np.arange(self.n), self.fan_out)

    @property
    def is_dense(self) -> bool:
        """True if a matrix of all weights has few zeros, so that it pays to store them."""
        return 4 * len(self.weight) > self.n**2


def load(path: str) -> Traffic:
    """Read a network."""
    with np.load(path) as arrays:
        return Traffic(*(arrays[name] for name in Traffic._fields))


class Running(NamedTuple):
    """A built network: a function that runs some steps, and one that returns spikes by neuron."""

    run: Callable[[int], object]
    spikes: Callable[[], np.ndarray]


def step_s(run: Callable[[int], object], clock: Callable[[], float] = time.process_time) -> float:
    """Return the CPU time of a step: the median of several rounds of a short run and a long one.

        step = (T_long - T_short) / (n_long - n_short)

    Some simulators prepare network and code in each call, which both runs have alike.
    """

    def seconds(steps: int) -> float:
        begin = clock()
        run(steps)
        return clock() - begin

    n = COUNTED
    while seconds(n) < LONG_S:
        n *= 4
    both = [(seconds(n // SHARE), seconds(n)) for _ in range(ROUNDS)]
    return statistics.median((long - short) / (n - n // SHARE) for short, long in both)


def contest(version: str, build: Callable[[Traffic], Running]) -> None:
    """Build and run the network in the file that the first command-line argument names.

    The second argument is the file for the result: CPU time of building and of a step, the number
    of steps that were counted, and their spikes by neuron, or in sum.
    """
    begin = time.process_time()
    run, spikes = build(load(sys.argv[1]))
    run(WARM_UP)
    before, built_s = spikes().copy(), time.process_time() - begin
    run(COUNTED)
    fired = (spikes() - before).tolist()
    found = {"version": version, "built_s": built_s, "steps": COUNTED, "spikes": fired}
    found["step_s"] = step_s(run)
    Path(sys.argv[2]).write_text(json.dumps(found), encoding="utf-8")
