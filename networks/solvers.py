"""Decoder solvers for populations that share an ensemble."""

import nengo
import numpy as np
from nengo.params import IntParam
from nengo.solvers import SolverParam


class PerDimension(nengo.solvers.Solver):
    """Solver that decodes each dimension from its own neurons alone.

    For an ensemble whose neurons ``[i n, (i + 1) n)`` encode dimension i, the decoders are those of
    ``d`` independent one-dimensional ensembles.

    Parameters
    ----------
    n_neurons : int
        Neurons per dimension.
    each : nengo.solvers.Solver, optional
        The solver of a dimension; by default regularised least squares.
    weights : bool
        True if the connection is wired from neuron to neuron.
    """

    compositional = True
    n_neurons = IntParam("n_neurons", low=1)
    each = SolverParam("each")

    def __init__(
        self, n_neurons: int, each: nengo.solvers.Solver | None = None, weights: bool = False
    ) -> None:
        super().__init__(weights=weights)
        self.n_neurons = n_neurons
        self.each = each or nengo.solvers.LstsqL2(reg=0.05)

    def __call__(
        self, A: np.ndarray, Y: np.ndarray, rng: object = np.random
    ) -> tuple[np.ndarray, dict[str, object]]:
        """Return the decoders of shape (n, d) for activities A (m, n) and values Y (m, d)."""
        decoders = np.zeros((A.shape[1], Y.shape[1]))
        for i in range(Y.shape[1]):
            mine = slice(i * self.n_neurons, (i + 1) * self.n_neurons)
            decoders[mine, i : i + 1], _ = self.each(A[:, mine], Y[:, i : i + 1], rng=rng)
        return decoders, {}


class Tied(nengo.solvers.Solver):
    r"""Solver with one decoder for all neurons: least squares with one unknown for each dimension.

    .. math:: d = \frac{s^T Y}{s^T s}, \quad s_m = \sum_n A_{mn}

    Neurons that encode one half of one value, with spread gains, need no more, and neurons with
    equal weights can share an axon on the chip.
    """

    compositional = True

    def __init__(self) -> None:
        super().__init__(weights=False)

    def __call__(
        self, A: np.ndarray, Y: np.ndarray, rng: object = np.random
    ) -> tuple[np.ndarray, dict[str, object]]:
        """Return the decoders of shape (n, d) for activities A (m, n) and values Y (m, d)."""
        total = A.sum(axis=1)
        decoder = total @ Y / (total @ total)
        return np.tile(decoder, (A.shape[1], 1)), {}


class TiedInParts(nengo.solvers.Solver):
    r"""Solver with one decoder for each of some parts of the neurons: least squares.

    .. math:: d = \arg\min_d |S d - Y|^2, \quad S_{mp} = \sum_{n \in p} A_{mn}

    As with `Tied`, the neurons of a part can share an axon on the chip.

    Parameters
    ----------
    n_parts : int
        The number of parts: consecutive neurons, as equal in number as possible, the first parts
        larger.
    """

    compositional = True
    n_parts = IntParam("n_parts", low=1)

    def __init__(self, n_parts: int) -> None:
        super().__init__(weights=False)
        self.n_parts = n_parts

    def __call__(
        self, A: np.ndarray, Y: np.ndarray, rng: object = np.random
    ) -> tuple[np.ndarray, dict[str, object]]:
        """Return the decoders of shape (n, d) for activities A (m, n) and values Y (m, d)."""
        parts = np.array_split(A, self.n_parts, axis=1)
        sums = np.stack([part.sum(axis=1) for part in parts], axis=1)
        decoders, *_ = np.linalg.lstsq(sums, Y, rcond=None)
        return np.repeat(decoders, [part.shape[1] for part in parts], axis=0), {}
