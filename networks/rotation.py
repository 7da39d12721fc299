"""A plane vector turned backwards by an angle, in spikes: every product as two squares.

    b = R(-angle) e = [e_x cos + e_y sin, e_y cos - e_x sin]
    a c = ((a + c) / 2)^2 - ((a - c) / 2)^2

A square is a function of one dimension, which few neurons decode well. The eight populations have
the same neurons, symmetric about zero, so that errors mostly cancel in the squares' differences.
"""

from dataclasses import dataclass

import nengo
import numpy as np

HALVES = 0.5 * np.array(
    [
        [1, 0, 1, 0],
        [1, 0, -1, 0],
        [0, 1, 0, 1],
        [0, 1, 0, -1],
        [0, 1, 1, 0],
        [0, 1, -1, 0],
        [1, 0, 0, 1],
        [1, 0, 0, -1],
    ]
)
"""Half sums and half differences of [e_x, e_y, cos, sin], two for each product."""

ROTATION = np.array([[1, -1, 1, -1, 0, 0, 0, 0], [0, 0, 0, 0, 1, -1, -1, 1]])
"""b from the squares of the halves."""

STRIDE = 7
"""Neurons with neighbouring intercepts are this many places apart in rate, so that no rate occurs
in one region alone. This holds even if the stride divides the number of neurons of a sign, as the
default of 70: these have ten rates, each at every tenth intercept."""

N_POINTS = 1000
"""Values at which the decoders of a square are solved."""


@dataclass(frozen=True)
class Squares:
    """Neurons of each of eight squares, their rates in Hz, and their synapses' time constant, s."""

    n_neurons: int
    max_rates: tuple[float, float]
    tau: float


def rotate(vector_and_angle: nengo.Node, body: nengo.Ensemble, squares: Squares) -> None:
    """Connect a vector and an angle to the ensemble of the vector turned back by that angle.

    Parameters
    ----------
    vector_and_angle : nengo.Node or view of one, 4 dimensions
        The vector, no longer than 1, and cosine and sine of the angle.
    body : nengo.Ensemble, 2 dimensions
        Receives the vector turned backwards.
    squares : Squares
        The neurons in between.
    """
    for number, (half, share) in enumerate(zip(HALVES, ROTATION.T, strict=True)):
        square = _half(f"square {number + 1}", squares)
        nengo.Connection(vector_and_angle, square, transform=half[np.newaxis], synapse=None)
        nengo.Connection(
            square, body, function=np.square, transform=share[:, np.newaxis], synapse=squares.tau
        )


def _half(label: str, squares: Squares) -> nengo.Ensemble:
    """Return neurons, the same for both signs, with intercepts that leave no gaps."""
    n = squares.n_neurons // 2
    place = (np.arange(n) + 0.5) / n
    low, high = squares.max_rates
    rates = low + (high - low) * place[np.arange(n) * STRIDE % n]
    return nengo.Ensemble(
        2 * n,
        1,
        max_rates=np.tile(rates, 2),
        encoders=np.repeat([[1.0], [-1.0]], n, axis=0),
        intercepts=np.tile(-1 + 1.9 * place, 2),
        eval_points=np.linspace(-1, 1, N_POINTS)[:, np.newaxis],
        label=label,
    )
