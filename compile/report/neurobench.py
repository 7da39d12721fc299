"""NeuroBench's names for our counts.

Source: J. Yik et al., "The NeuroBench framework for benchmarking neuromorphic computing algorithms
and systems", Nature Communications 16, 2025; github.com/NeuroBench/neurobench, neurobench/metrics.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.fanout import all_operations
from spikeport.compile.image.manifest import STATE_BITS
from spikeport.constants import BITS_PER_BYTE
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.limits import CoreUse


@dataclass(frozen=True)
class NeuroBench:
    """Static and workload metrics of an image.

    Parameters
    ----------
    footprint_bytes : int
        Synaptic memory in whole words, and current and voltage of every compartment.
    connection_sparsity : float
        Zeros among the stored weights: #zeros / #weights.
    dense : float
        Synaptic operations of a step in which every source spikes.
    effective_acs : float or None
        Mean synaptic operations of a step, all of them additions, as spikes are 0 or 1; zeros that
        are stored are read, and count. None without activity.
    effective_macs : float or None
        Mean multiplications of a step: none.
    """

    footprint_bytes: int
    connection_sparsity: float
    dense: float
    effective_acs: float | None = None
    effective_macs: float | None = None


def neurobench(image: ChipImage, cores: Sequence[CoreUse]) -> NeuroBench:
    """Return the static metrics of an image."""
    state_bits = image.n_compartments * 2 * STATE_BITS  # current and voltage
    bits = sum(core.synapse_bits for core in cores) + state_bits
    weights = image.synapses.weight
    return NeuroBench(
        footprint_bytes=-(-bits // BITS_PER_BYTE),
        connection_sparsity=float(np.mean(weights == 0)) if weights.size else 0.0,
        dense=float(all_operations(image)),
    )


def workload(activity: Activity) -> dict[str, float]:
    """Return the workload metrics of a run, or of expected activity."""
    operations = float(activity.over_steps("synaptic_operations").sum() / activity.n_steps)
    return {"effective_acs": operations, "effective_macs": 0.0}
