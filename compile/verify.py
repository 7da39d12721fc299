"""Placement -> violations: every limit of the chip on every core, all at once."""

import math
from collections.abc import Sequence

from spikeport.compile.violation import Violation
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.limits import CoreUse, Usage, usages

CURES = {
    "cores": "use fewer or smaller ensembles, or fewer decoded connections: each takes a core",
    "compartments": "split the ensemble into {parts} that share its targets",
    "in_axons": "split the source ensemble into {parts} that decode into the same target, "
    "each with the targets divided by {parts}",
    "out_axons": "split the source ensemble into {parts}, or give it fewer connections",
    "synapse_bits": "split the ensemble into {parts}, or connect it more sparsely",
    "compartment_profiles": "use the same time constants and refractory period on this core",
    "threshold_profiles": "use the same threshold for the neurons of this core",
    "synapse_profiles": "bundle connections of this core that share a weight format",
}


def verify(cores: Sequence[CoreUse], chip: Chip) -> list[Violation]:
    """Every limit that is exceeded, with the smallest change that helps."""
    return [_violation(usage) for usage in usages(cores, chip) if usage.exceeded]


def _violation(usage: Usage) -> Violation:
    parts = math.ceil(usage.used / usage.limit)
    return Violation(
        usage.object,
        usage.resource.replace("_", "-"),
        f"{usage.used:,}",
        f"{usage.limit:,}",
        CURES[usage.resource].format(parts=parts),
    )
