"""What each core of an image holds, counted from the image itself.

Counts are those of the chip, and in three places stricter than nengo-loihi's own: an output axon
is counted for every compartment that has one (nengo-loihi counts distinct targets, too few where
compartments share an axon after splitting); synapses whose targets are not consecutive carry index
bits, whatever their format says; profiles are counted at all.
"""

import numpy as np
from nengo_loihi.block import SynapseConfig

from spikeport.compile.image import ChipImage
from spikeport.hardware_models.limits import CoreUse

WORD_BITS = 64
LIST_HEADER_BITS = 4 + 6  # synapse index and count of every list of synapses
INDEXED = 0  # the compression that stores an index with every weight
PROFILE = ("decay_u", "decay_v", "refract_delay", "enable_noise")


def core_uses(image: ChipImage) -> list[CoreUse]:
    """Count the resources of every core."""
    in_axons = _in_axons(image)
    out_axons = _out_axons(image)
    bits = _synapse_bits(image)
    compartments = np.bincount(image.compartment_core, minlength=image.n_cores)
    return [
        CoreUse(
            label=label,
            compartments=int(compartments[core]),
            in_axons=int(in_axons[core]),
            out_axons=int(out_axons[core]),
            synapse_bits=int(bits[core]),
            **_profiles(image, core),
        )
        for core, label in enumerate(image.cores)
    ]


def synapse_core(image: ChipImage) -> np.ndarray:
    """(n_synapse_groups,) core of each synapse group."""
    return image["block_core"][image["synapse_block"]]


def _in_axons(image: ChipImage) -> np.ndarray:
    sizes = np.diff(image["in_axon_start"])
    return np.bincount(synapse_core(image), weights=sizes, minlength=image.n_cores)


def _out_axons(image: ChipImage) -> np.ndarray:
    counts = np.zeros(image.n_cores, dtype=int)
    pop_type = image["synapse_pop_type"][image["route_synapse"]]
    for route in np.flatnonzero(image["route_input"] == 0):
        reached = image["route_axon"][image.part("route_start", route)] >= 0
        slots = 2 if pop_type[route] == 32 else 1
        counts[image["block_core"][image["route_source"][route]]] += slots * reached.sum()
    return counts


def _synapse_bits(image: ChipImage) -> np.ndarray:
    """Bits of all lists: groups of up to 64 synapses, each group rounded up to whole words."""
    bits = np.zeros(image.n_cores, dtype=int)
    column = {name: i for i, name in enumerate(image.manifest["synapse_format"])}
    for group, core in enumerate(synapse_core(image)):
        form = image["synapse_format"][group]
        rows = image.part("row_start", group)
        sizes = np.diff(image["row_weight_start"][rows.start : rows.stop + 1])
        weight_bits = SynapseConfig.WEIGHT_BITS_MAP[form[column["weight_bits"]]]
        width = weight_bits + form[column["delay_bits"]] + form[column["tag_bits"]]
        if form[column["compression"]] == INDEXED or not _consecutive(image, rows):
            width += SynapseConfig.INDEX_BITS_MAP[form[column["idx_bits"]]]
        bits[core] += _list_bits(sizes, width, per_list=form[column["n_synapses"]] + 1)
    return bits


def _consecutive(image: ChipImage, rows: slice) -> bool:
    """Whether every row of a group reaches compartments 0, 1, 2 ... for each of its atoms."""
    start = image["row_weight_start"]
    for row in range(rows.start, rows.stop):
        indices = image["indices"][start[row] : start[row + 1]].reshape(image["row_atoms"][row], -1)
        if not np.array_equal(indices, np.broadcast_to(np.arange(indices.shape[1]), indices.shape)):
            return False
    return True


def _list_bits(sizes: np.ndarray, width: int, per_list: int) -> int:
    full, rest = np.divmod(sizes, per_list)
    words = full * _words(per_list * width) + np.where(rest > 0, _words(rest * width), 0)
    return int(words.sum()) * WORD_BITS


def _words(payload_bits: np.ndarray | int) -> np.ndarray | int:
    return -(-(payload_bits + LIST_HEADER_BITS) // WORD_BITS)


def _profiles(image: ChipImage, core: int) -> dict[str, int]:
    mine = image.compartment_core == core
    compartment = np.stack([image[k][mine] for k in PROFILE])
    return {
        "compartment_profiles": np.unique(compartment, axis=1).shape[1],
        "threshold_profiles": np.unique(image["vth"][mine]).size,
        "synapse_profiles": len(
            np.unique(image["synapse_format"][synapse_core(image) == core], axis=0)
        ),
    }
