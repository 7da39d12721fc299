"""Spikes in a run's time series: an entry for each spike, not a table of mostly zeros."""

from collections.abc import Mapping

import numpy as np

from spikeport.constants import DT_S


def ragged(rasters: Mapping[str, np.ndarray]) -> dict[str, object]:
    """Return variables of a dataset with the time and the neuron of every spike.

    Parameters
    ----------
    rasters : mapping of str to (n_steps, n_neurons) array
        The raster of each population, in which any value other than 0 is a spike.

    Returns
    -------
    variables : dict
        ``<name>_time``, the end of the spike's step in s, and ``<name>_neuron``, the number of the
        neuron in the population, for each population; both along ``<name>_spike``.
    """
    found: dict[str, object] = {}
    for name, raster in rasters.items():
        step, neuron = np.nonzero(raster)
        along, text = f"{name}_spike", f"number of the neuron of {name}"
        found[f"{name}_time"] = along, (step + 1) * DT_S, {"units": "s", "long_name": "spike"}
        found[f"{name}_neuron"] = along, neuron, {"long_name": text}
    return found
