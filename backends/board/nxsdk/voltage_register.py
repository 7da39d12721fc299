"""The register V, which counts the refractory time down after a spike.

Meanwhile V holds `SPIKE_VOLTAGE` times the refractory steps that are left.
"""

import numpy as np

from spikeport.backends.native.loaded import State


def refractory_left(state: State, refract_delay: np.ndarray) -> np.ndarray:
    """Return the refractory steps that V counts, 0 where it holds the voltage, (n_compartments,).

    In the step of a spike V counts the whole refractory time, by which snips detect the spike.
    """
    n = len(refract_delay)
    return np.where(state.spiked[:n] == 1, refract_delay, state.refractory[:n])
