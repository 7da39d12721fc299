"""The register V, which counts the refractory time down after a spike.

V holds `SPIKE_VOLTAGE` times the steps that are left.
"""

import numpy as np

from spikeport.backends.native.loaded import State


def refractory_left(state: State, refract_delay: np.ndarray) -> np.ndarray:
    """Return the refractory steps that V counts, 0 where it holds the voltage, (n_compartments,).

    In the step of a spike V has all of the refractory time: that is how snips tell one.
    """
    n = len(refract_delay)
    return np.where(state.spiked[:n] == 1, refract_delay, state.refractory[:n])
