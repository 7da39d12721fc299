"""Decoders that are solved once where several connections ask for the same.

Each connection of an ensemble has decoders of its own, which nengo-loihi solves one by one: those
into the 40 ensembles of a circular convolution are the same 40 times. Regularised least squares by
Cholesky's method draw no random numbers, so that equal values have equal decoders, to the bit.
"""

import contextlib
from collections import OrderedDict
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import nengo
import nengo_loihi.builder.connection as connections
import numpy as np
from nengo.solvers import LstsqL2
from nengo.utils.least_squares_solvers import Cholesky

from spikeport.compile.loihi.replaced import replaced

MOST_KEPT = 4
"""Ensembles whose last decoders are kept: connections come sorted by the name of their source, and
the values at evaluation points take megabytes."""

Solve = Callable[..., tuple[np.ndarray, dict[str, Any]]]
"""nengo-loihi's ``solve_for_decoders``."""


class _Solved(NamedTuple):
    """The values that decoders were solved for, and the solution."""

    points: np.ndarray
    targets: np.ndarray
    decoders: np.ndarray
    info: dict[str, Any]


class _Solves:
    """Solutions of the last ensembles, by ensemble, solver and its neurons' constants."""

    def __init__(self, solve: Solve) -> None:
        self._solve = solve
        self._kept: OrderedDict[tuple[object, ...], _Solved] = OrderedDict()

    def solve(
        self,
        conn: nengo.Connection,
        gain: np.ndarray,
        bias: np.ndarray,
        x: np.ndarray,
        targets: np.ndarray,
        rng: np.random.RandomState,
        dt: float,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Return decoders (n_neurons, n_values) of values ``x``, and how they were found."""
        if not _draws_nothing(conn.solver):
            return self._solve(conn, gain, bias, x, targets, rng, dt)
        key = (conn.pre_obj, conn.solver, dt)
        kept = self._kept.pop(key, None)
        if kept is None or not (_equal(kept.points, x) and _equal(kept.targets, targets)):
            kept = _Solved(x, targets, *self._solve(conn, gain, bias, x, targets, rng, dt))
        self._kept[key] = kept
        if len(self._kept) > MOST_KEPT:
            self._kept.popitem(last=False)
        return kept.decoders.copy(order="K"), dict(kept.info)


def _draws_nothing(solver: nengo.solvers.Solver) -> bool:
    """Return whether a solver is known to draw no random numbers."""
    return type(solver) is LstsqL2 and type(solver.solver) is Cholesky


def _equal(one: np.ndarray, other: np.ndarray) -> bool:
    # Products of matrices in another order may differ in their last bits.
    return one.strides == other.strides and np.array_equal(one, other)


@contextlib.contextmanager
def shared_solves() -> Iterator[None]:
    """Let connections that are built share equal decoders."""
    solves = _Solves(connections.solve_for_decoders)
    with replaced(connections, "solve_for_decoders", solves.solve):
        yield
