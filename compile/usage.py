"""What the blocks and cores of an image hold, counted from the image itself.

Counts are those of the chip, and in three places stricter than nengo-loihi's own: an output axon
is counted for every compartment that has one (nengo-loihi counts distinct targets, too few where
compartments share an axon after splitting); synapses whose targets are not consecutive carry index
bits, whatever their format says; profiles are counted at all.
"""

import itertools
from typing import NamedTuple

import numpy as np
from nengo_loihi.block import SynapseConfig

from spikeport.compile.image import ChipImage
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.limits import CoreUse

INDEXED = 0  # the compression that stores an index with every weight
AMOUNTS = ("compartments", "in_axons", "out_axons", "synapse_bits")
PROFILE = ("decay_u", "decay_v", "refract_delay", "enable_noise")


class ListFormat(NamedTuple):
    """How a synapse group stores its rows: bits per synapse, and synapses per list at most."""

    width_bits: int
    per_list: int


class Layout(NamedTuple):
    """How a chip stores lists of synapses: bits of a word and of a list's header."""

    word_bits: int = 1
    header_bits: int = 0


def core_uses(image: ChipImage, chip: Chip) -> list[CoreUse]:
    """Count the resources of every core."""
    amounts = np.zeros((image.n_cores, len(AMOUNTS)), dtype=int)
    np.add.at(amounts, image["block_core"], block_amounts(image, chip))
    return [
        CoreUse(
            label=label,
            **dict(zip(AMOUNTS, amounts[core].tolist(), strict=True)),
            **_profiles(image, core),
        )
        for core, label in enumerate(image.cores)
    ]


def block_amounts(image: ChipImage, chip: Chip) -> np.ndarray:
    """(n_blocks, 4) what each block takes of the resources in `AMOUNTS`."""
    n, block = image.n_blocks, image["synapse_block"]
    sizes = np.diff(image["block_start"])
    in_axons = np.bincount(block, weights=np.diff(image["in_axon_start"]), minlength=n)
    owner = np.repeat(np.arange(n), sizes)
    out_axons = np.bincount(owner, weights=out_slots(image, chip), minlength=n)
    bits = np.bincount(block, weights=_group_bits(image, chip), minlength=n)
    return np.stack([sizes, in_axons, out_axons, bits], axis=1).astype(int)


def synapse_core(image: ChipImage) -> np.ndarray:
    """(n_synapse_groups,) core of each synapse group."""
    return image["block_core"][image["synapse_block"]]


def axon_slots(image: ChipImage, chip: Chip) -> np.ndarray:
    """(n_synapse_groups,) slots that an output axon to each synapse group takes."""
    memory = chip.synapse_memory
    population = 1 if memory is None else memory.population_32_slots.count
    return np.where(image["synapse_pop_type"] == 32, population, 1)


def out_slots(image: ChipImage, chip: Chip) -> np.ndarray:
    """(n_compartments,) slots that the output axons of each compartment take."""
    slots = np.zeros(image.n_compartments, dtype=int)
    per_axon = axon_slots(image, chip)[image["route_synapse"]]
    for route in np.flatnonzero(image["route_input"] == 0):
        reached = image["route_axon"][image.part("route_start", route)] >= 0
        slots[image.part("block_start", image["route_source"][route])] += per_axon[route] * reached
    return slots


def layout(chip: Chip) -> Layout:
    """How a chip stores lists of synapses; bits alone where that is not public."""
    memory = chip.synapse_memory
    return Layout() if memory is None else Layout(memory.word.count, memory.list_header.count)


def list_formats(image: ChipImage) -> list[ListFormat]:
    """How each synapse group stores its rows."""
    names, consecutive = image.manifest["synapse_format"], is_consecutive(image)
    forms = [dict(zip(names, row, strict=True)) for row in image["synapse_format"].tolist()]
    return [_list_format(form, near) for form, near in zip(forms, consecutive, strict=True)]


def _list_format(form: dict[str, int], consecutive: bool) -> ListFormat:
    width = SynapseConfig.WEIGHT_BITS_MAP[form["weight_bits"]]
    width += form["delay_bits"] + form["tag_bits"]
    if form["compression"] == INDEXED or not consecutive:
        width += SynapseConfig.INDEX_BITS_MAP[form["idx_bits"]]
    return ListFormat(width, form["n_synapses"] + 1)


def is_consecutive(image: ChipImage) -> np.ndarray:
    """(n_synapse_groups,) whether each row reaches targets 0, 1, 2 ... for each of its atoms."""
    first = np.zeros(len(image["indices"]), dtype=bool)
    first[_atom_starts(image)] = True
    expected = np.where(first, 0, np.roll(image["indices"], 1) + np.int16(1))
    row = np.searchsorted(
        image["row_weight_start"], np.flatnonzero(image["indices"] != expected), side="right"
    )
    group = np.searchsorted(image["row_start"], row - 1, side="right") - 1
    return np.bincount(group, minlength=len(image["synapse_block"])) == 0


def _atom_starts(image: ChipImage) -> np.ndarray:
    """Where the weights of each atom of each row begin, but for those without any."""
    sizes, atoms = np.diff(image["row_weight_start"]), image["row_atoms"]
    number = np.arange(atoms.sum()) - np.repeat(np.cumsum(atoms) - atoms, atoms)
    length = np.repeat(sizes // np.maximum(atoms, 1), atoms)
    return (np.repeat(image["row_weight_start"][:-1], atoms) + number * length)[length > 0]


def list_bits(sizes: np.ndarray, form: ListFormat, layout: Layout) -> int:
    """Bits of rows of the given sizes: lists of at most so many synapses, each in whole words."""
    full, rest = np.divmod(sizes, form.per_list)
    words = full * _words(np.asarray(form.per_list * form.width_bits), layout)
    words += np.where(rest > 0, _words(rest * form.width_bits, layout), 0)
    return int(words.sum()) * layout.word_bits


def _words(payload_bits: np.ndarray, layout: Layout) -> np.ndarray:
    return -(-(payload_bits + layout.header_bits) // layout.word_bits)


def _group_bits(image: ChipImage, chip: Chip) -> list[int]:
    sizes, rows = np.diff(image["row_weight_start"]), itertools.pairwise(image["row_start"])
    return [
        list_bits(sizes[first:end], form, layout(chip))
        for (first, end), form in zip(rows, list_formats(image), strict=True)
    ]


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
