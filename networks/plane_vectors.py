"""Neurons of a vector in the plane, of which its length or its angle is decoded.

    length = hypot(x, y),  bearing = atan2(y, x)

A neuron responds along a line, and bends where the vector turns away from its encoder by a right
angle. For lengths, encoders are even in all directions. For bearings, most neurons bend nearly
ahead, where the function that is decoded has its limits, and every neuron has a mirror image: what
one errs on the left, the other errs on the right, so that nothing is off straight ahead.
"""

import nengo
import numpy as np

SHARE = 0.7
"""Of neurons that bend, and of values that are decoded, nearly ahead."""

N_POINTS = 3000
"""Values at which decoders are solved."""


def length_ensemble(label: str, n_neurons: int) -> nengo.Ensemble:
    """Neurons of a vector no longer than 1, whose length is to be decoded."""
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
    label: str, n_neurons: int, rates: tuple[float, float], ahead_rad: float, seed: int
) -> nengo.Ensemble:
    """Neurons of a vector no longer than 1, a function of whose bearing is to be decoded.

    Parameters
    ----------
    label : str
        Its name.
    n_neurons : int
        An even number.
    rates : tuple of float
        Highest firing rates in Hz, drawn uniformly from these.
    ahead_rad : float
        Most neurons bend within this angle, to either side.
    seed : int
        Of neurons and evaluation points.
    """
    rng = np.random.RandomState(seed)
    n = n_neurons // 2
    bend = _nearly_ahead(n, ahead_rad, rng)
    encoders = _directions(bend + np.pi / 2 * rng.choice([-1, 1], n))
    # angle and length scale with the vector as neurons do whose thresholds lie near zero
    intercepts = rng.uniform(-0.1, 0.1, n)
    return nengo.Ensemble(
        n_neurons,
        2,
        encoders=_mirrored(encoders),
        intercepts=np.tile(intercepts, 2),
        max_rates=np.tile(rng.uniform(*rates, n), 2),
        eval_points=_mirrored(_points(ahead_rad, rng)),
        label=label,
    )


def _points(ahead_rad: float, rng: np.random.RandomState) -> np.ndarray:
    """(n, 2) values in the unit disc, most of them nearly ahead."""
    length = np.sqrt(rng.uniform(0, 1, N_POINTS // 2))
    return length[:, np.newaxis] * _directions(_nearly_ahead(len(length), ahead_rad, rng))


def _nearly_ahead(n: int, ahead_rad: float, rng: np.random.RandomState) -> np.ndarray:
    """(n,) angles, of which most are within a limit and the others anywhere."""
    angle = rng.uniform(-np.pi, np.pi, n)
    angle[: round(SHARE * n)] *= ahead_rad / np.pi
    return angle


def _directions(angle_rad: np.ndarray) -> np.ndarray:
    return np.stack((np.cos(angle_rad), np.sin(angle_rad)), axis=1)


def _mirrored(vectors: np.ndarray) -> np.ndarray:
    return np.concatenate((vectors, vectors * [1, -1]))
