"""Neurons of a vector in the plane, of which its length or its angle is decoded.

    length = hypot(x, y),  bearing = atan2(y, x)

A neuron responds along a line, and bends where the vector turns away from its encoder by a right
angle. For lengths, encoders are even in all directions. For bearings, most neurons bend nearly
ahead, where the function that is decoded has its limits, and every neuron has a mirror image: what
one errs on the left, the other errs on the right, so that nothing is off straight ahead.
"""

import nengo
import numpy as np

from spikeport.arrays import Floats

SHARE = 0.7
"""The share of neurons that bend, and of values that are decoded, nearly ahead."""

THRESHOLD = 0.1
"""Largest threshold of a neuron of a bearing, to either side of zero."""

N_POINTS = 3000
"""Values at which decoders are solved."""

R2 = (0.7548776662466927, 0.5698402909980532)
"""Steps of the sequence; 1/p and 1/p^2 where p^3 = p + 1."""


def length_ensemble(label: str, n_neurons: int) -> nengo.Ensemble:
    """Return neurons of a vector no longer than 1, whose length is to be decoded."""
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
    """Return neurons of a vector no longer than 1, a function of whose bearing is to be decoded.

    Thresholds and rates are spread evenly where they bend, not drawn: with some draws the value
    decoded nearly ahead was too steep by a quarter.

    Parameters
    ----------
    label : str
        Its name.
    n_neurons : int
        An even number.
    rates : tuple of float
        Highest firing rates in Hz are between these.
    ahead_rad : float
        Most neurons bend within this angle, to either side.
    """
    n = n_neurons // 2
    side = np.resize([-1, 1], n)
    encoders = _directions(_nearly_ahead(n, ahead_rad) + np.pi / 2 * side)
    threshold, rate = _spread(n)
    low, high = rates
    # angle and length scale with the vector as neurons do whose thresholds lie near zero
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
