"""The scale of decoded values on their way from the chip to the host.

A read-out on the chip is a compartment that does not spike as long as the value that it decodes in
one step stays below a threshold. A value beyond it is lost, without a warning.
"""

import nengo
import numpy as np
from nengo_loihi.builder import Model

MARGIN = 1.05
"""A factor above the growth of weights by rounding."""


def readout_scale(decoders: np.ndarray, ensemble: nengo.Ensemble, dt_s: float) -> np.ndarray:
    r"""Return the divisor of each decoded value.

    .. math:: s_r = 1.05 \, c \max_n |D_{rn}|

    Every row thus makes the same use of the weights' bits; c is the least factor for which no
    threshold is reached even if all neurons spike at once, and 1.05 allows for rounding.

    Parameters
    ----------
    decoders : (d, n) array
        Decoders; no row is zero throughout.
    ensemble : nengo.Ensemble
        The ensemble that is decoded.
    dt_s : float
        The time step, in seconds.

    Returns
    -------
    scale : (d,) array
    """
    largest = np.abs(decoders).max(axis=1)
    # In the worst step all neurons that raise a value spike, and none that lower it, or vice versa.
    peak = np.maximum(decoders.clip(min=0).sum(axis=1), (-decoders).clip(min=0).sum(axis=1))
    amplitude = getattr(ensemble.neuron_type, "amplitude", 1.0)
    threshold = Model().vth_nonspiking * ensemble.radius * dt_s / amplitude
    scale: np.ndarray = largest * (peak / largest).max() * MARGIN / threshold
    return scale
