r"""A read-out refitted to what the halves of a spiking policy's units gave.

.. math::

    W, b = \arg\min \sum_t |F e_t|^2 + m (\lambda \max F h)^2 |W - W_0|^2,
    \quad e_t = W h_t + b - a_{t-k}

    F = S + P (1 - S) / r + (1 - P) (1 - S) / n

``h_t`` is what the halves of the last hidden layer's units gave for observation ``t``, ``a_t`` the
exact action, ``W_0`` the policy's own weights, and ``k`` a delay. What an error does to a walking
robot depends on how it comes: ``S``, a moving average, keeps what lasts, which throws it off its
path; ``P``, the projection on what the halves would give exactly, keeps what recurs with every
step, which makes it slip and drift; the rest is noise of spikes, which averages out. Without ``P``
that noise would shrink the weights, as errors in the regressors do: what the halves would give
exactly are instruments in the sense of Wright (1928), here weighted, not exclusive.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from spikeport.networks.policy_solving import refit
from spikeport.networks.policy_values import Readout

METHOD = 1
"""One more whenever this file refits otherwise: a calibration kept from before is then refused."""

SETTLING = 20
"""Observations at the start that are not used."""
LAG = 1
"""Observations from the one an action is for to the one at whose end it is given. The filters of
spikes delay by more, and a read-out that looks ahead errs more: by an eighth for each observation.
But a robot whose policy is late turns less than it is told: by 5 % for 10 ms."""

STRIDE = 100
"""Observations over which an error is slow, 0.5 s: two steps of a gait."""
RECURRING, NOISE = 3.0, 9.0
"""By how much what recurs, and what is noise, counts less than what is slow."""
REGULARISATION = 0.006
"""Lambda, as of `nengo.solvers.LstsqL2`: with half and twice as much, robots strayed further."""


class Played(NamedTuple):
    """What the halves gave for observations, and what they give exactly, both (m, n_halves)."""

    halves: np.ndarray
    exact: np.ndarray


def refit_lagged(nominal: Readout, *played: Played) -> Readout:
    """The read-out of played observations, for actions of `LAG` observations before.

    ``nominal`` is the policy's own layer, by halves: of exact halves it makes the exact action.
    """
    found, wanted = zip(*(_lagged(nominal, part) for part in played), strict=True)
    parts = np.concatenate(found), np.concatenate(wanted)
    return refit(nominal, *parts, regularisation=REGULARISATION)


def _lagged(nominal: Readout, played: Played) -> tuple[np.ndarray, np.ndarray]:
    """Halves and the actions wanted of them, both emphasised."""
    halves, exact = played.halves[SETTLING + LAG :], played.exact[SETTLING:-LAG]
    wanted = exact @ nominal.weights.T + nominal.bias
    return emphasise(halves, exact), emphasise(wanted, exact)


def emphasise(values: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """F x, (m, d), of values x (m, d): what lasts whole, what recurs and noise lessened.

    ``exact`` (m, n_halves) is what the halves give exactly: what is linear in it recurs.
    """
    slow = uniform_filter1d(values, STRIDE, axis=0)
    recurring = exact @ np.linalg.lstsq(exact, values - slow, rcond=None)[0]
    return slow + recurring / RECURRING + (values - slow - recurring) / NOISE
