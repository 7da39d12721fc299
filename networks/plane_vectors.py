"""Neurons that represent a vector in the plane, to decode its length or its angle.

    length = hypot(x, y),  bearing = atan2(y, x)

A neuron responds along its encoder, and its response has a kink where the vector is at a right
angle to it. For lengths, encoders are spread evenly over all directions. For bearings, most neurons
have their kink nearly ahead, where the decoded function has its limits, and every neuron has a
mirror image. Their errors to the left and right mirror each other, and cancel straight ahead.
"""

import nengo
import numpy as np

from spikeport.arrays import Floats

SHARE = 0.7
"""The share of neurons with their kink, and of evaluation points, nearly ahead."""

THRESHOLD = 0.1
"""Largest threshold of a neuron of a bearing, to either side of zero."""

N_POINTS = 3000
"""Values at which decoders are solved."""

R2 = (0.7548776662466927, 0.5698402909980532)
"""Steps of the R2 sequence: 1/p and 1/p^2 where p^3 = p + 1."""


def length_ensemble(label: str, n_neurons: int) -> nengo.Ensemble:
    """Return neurons of a vector no longer than 1, to decode its length."""
    turn = 2 * np.pi * np.arange(n_neurons) / n_neurons
    return nengo.Ensemble(
        n_neurons,
        2,
        encoders=_directions(turn),
        intercepts=nengo.dists.Uniform(0.0, 0.5),
        n_eval_points=N_POINTS,
        label=label,
    )


def bearing_ensemble(
    label: str, n_neurons: int, rates: tuple[float, float], ahead_rad: float
) -> nengo.Ensemble:
    """Return neurons of a vector no longer than 1, to decode a function of its bearing.

    Thresholds and rates are spread evenly over the kinks, not drawn: with some draws, the decoded
    function was too steep by a quarter nearly ahead.

    Parameters
    ----------
    label : str
        Its name.
    n_neurons : int
        An even number.
    rates : tuple of float
        The range of the highest firing rates, in Hz.
    ahead_rad : float
        Most neurons have their kink within this angle, to either side.
    """
    n = n_neurons // 2
    side = np.resize([-1, 1], n)
    encoders = _directions(_nearly_ahead(n, ahead_rad) + np.pi / 2 * side)
    threshold, rate = _spread(n)
    low, high = rates
    # With a threshold near zero, a neuron's kink is at the same angle for short and long vectors.
    intercepts = THRESHOLD * (2 * threshold - 1)
    return nengo.Ensemble(
        n_neurons,
        2,
        encoders=_mirrored(encoders),
        intercepts=np.tile(intercepts, 2),
        max_rates=np.tile(low + (high - low) * rate, 2),
        eval_points=_mirrored(_points(ahead_rad)),
        label=label,
    )


def _points(ahead_rad: float) -> Floats:
    """Return values (n, 2) in the unit disc, most of them nearly ahead."""
    n = N_POINTS // 2
    length: Floats = np.sqrt(_spread(n)[0])
    return length[:, np.newaxis] * _directions(_nearly_ahead(n, ahead_rad))


def _nearly_ahead(n: int, ahead_rad: float) -> Floats:
    """Return angles (n,), most of them spread within a limit, the others everywhere."""
    near = round(SHARE * n)
    return np.concatenate((ahead_rad * _evenly(near), np.pi * _evenly(n - near)))


def _evenly(n: int) -> Floats:
    """Return values (n,) between -1 and 1, in order."""
    return (2 * np.arange(n) + 1) / n - 1


def _spread(n: int) -> Floats:
    """Return values (2, n) between 0 and 1 that fill the square (Roberts 2018, the R2 sequence)."""
    return (0.5 + np.outer(R2, np.arange(n))) % 1


def _directions(angle_rad: Floats) -> Floats:
    return np.stack((np.cos(angle_rad), np.sin(angle_rad)), axis=1)


def _mirrored(vectors: Floats) -> Floats:
    return np.concatenate((vectors, vectors * [1, -1]))
