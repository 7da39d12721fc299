"""Decoders that are solved once where several connections need the same decoders.

nengo-loihi solves the decoders of each connection separately: the connections into the 40 ensembles
of a circular convolution have the same decoders 40 times. Regularised least squares by Cholesky's
method draw no random numbers, so that equal values have equal decoders, to the bit.
"""

import contextlib
import hashlib
from collections import OrderedDict
from collections.abc import Iterator
from typing import Any, NamedTuple

import nengo
import nengo_loihi.builder.connection as connections
import numpy as np
from nengo.solvers import LstsqL2
from nengo.utils.least_squares_solvers import Cholesky

from spikeport.compile.loihi.quick_builder import Solve
from spikeport.compile.loihi.replaced import replaced

MOST_KEPT = 4
"""Ensembles whose last decoders are kept: connections are sorted by the name of their source."""


class _Solved(NamedTuple):
    """A solution, and the digest of the values that it was found for."""

    digest: bytes
    decoders: np.ndarray
    info: dict[str, Any]


class _Solves:
    """Solutions for the last ensembles, by ensemble, solver and time step."""

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
        """Return decoders (n_neurons, n_values) of values ``x``, and the solver's information."""
        if not _draws_nothing(conn.solver):
            return self._solve(conn, gain, bias, x, targets, rng, dt)
        key = (conn.pre_obj, conn.solver, dt)
        digest = _digest(x, targets)
        kept = self._kept.pop(key, None)
        if kept is None or kept.digest != digest:
            kept = _Solved(digest, *self._solve(conn, gain, bias, x, targets, rng, dt))
        self._kept[key] = kept
        if len(self._kept) > MOST_KEPT:
            self._kept.popitem(last=False)
        return kept.decoders.copy(order="K"), dict(kept.info)


def _draws_nothing(solver: nengo.solvers.Solver) -> bool:
    """Return whether a solver is known to draw no random numbers."""
    return type(solver) is LstsqL2 and type(solver.solver) is Cholesky


def _digest(*arrays: np.ndarray) -> bytes:
    """Return the digest of arrays and their layout.

    The arrays themselves are not kept: 10,000 evaluation points of 1,000 neurons take 80 MB.
    """
    found = hashlib.sha256()
    for array in arrays:
        # Products of matrices in another order may differ in their last bits.
        found.update(repr((array.dtype.str, array.shape, array.strides)).encode())
        found.update(np.ascontiguousarray(array).data)
    return found.digest()


@contextlib.contextmanager
def shared_solves() -> Iterator[None]:
    """Let connections share equal decoders while they are built, within the context."""
    solves = _Solves(connections.solve_for_decoders)
    with replaced(connections, "solve_for_decoders", solves.solve):
        yield
