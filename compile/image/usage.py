"""Resources that the blocks and cores of an image take, counted from the image itself.

The chip counts in this way. Three counts are stricter than nengo-loihi's own:

- An output axon counts for every compartment that has it, unless compartments share a list of
  population axons. nengo-loihi counts distinct targets, too few where compartments share an axon
  after splitting.
- Synapses whose targets are not consecutive carry index bits, whatever their format says.
- Profiles are counted, which nengo-loihi does not do.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries, row_lengths
from spikeport.compile.image.manifest import Manifest
from spikeport.compile.image.soft_rows import soft_row_bits
from spikeport.compile.image.tables import positions
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.limits import CoreUse

INDEXED = 0  # the compression that stores an index with every weight
AMOUNTS = ("compartments", "in_axons", "out_axons", "synapse_bits")
PROFILE = ("decay_u", "decay_v", "refract_delay", "enable_noise")


class ListFormat(NamedTuple):
    """The format of a synapse group's rows: bits per synapse, and the most synapses per list."""

    width_bits: int
    per_list: int


class SynapseLayout(NamedTuple):
    """The memory layout of a chip's lists of synapses: bits of a word and of a list's header."""

    word_bits: int = 1
    header_bits: int = 0


def core_uses(image: ChipImage, chip: ChipModel) -> list[CoreUse]:
    """Count the resources of every core."""
    amounts = np.zeros((image.n_cores, len(AMOUNTS)), dtype=int)
    np.add.at(amounts, image.blocks.core, block_amounts(image, chip))
    return [
        CoreUse(
            label=label,
            **dict(zip(AMOUNTS, amounts[core].tolist(), strict=True)),
            **profiles,
        )
        for core, (label, profiles) in enumerate(zip(image.cores, _profiles(image), strict=True))
    ]


def block_amounts(image: ChipImage, chip: ChipModel) -> np.ndarray:
    """Return the resources that each block takes, in the order of `AMOUNTS`, (n_blocks, 4).

    Compartments of a block that send to the same population axons share them.
    """
    n, block = image.n_blocks, image.groups.block
    sizes = np.diff(image.blocks.start)
    in_axons = np.bincount(block, weights=np.diff(image.groups.axon_start), minlength=n)
    # The atom of a spike is stored with its compartment, so one list serves all atoms.
    # A soft core has no populations: each compartment has a list of its own.
    shared = False if chip.soft_memory is not None else _share_lists(image)
    slots = np.where(shared, 0, out_slots(image, chip))
    out_axons = np.bincount(image.compartment_block, weights=slots, minlength=n)
    bits = np.bincount(block, weights=_group_bits(image, chip), minlength=n)
    return np.stack([sizes, in_axons, out_axons, bits], axis=1).astype(int)


def axon_slots(image: ChipImage, chip: ChipModel) -> np.ndarray:
    """Return the slots that an output axon to each synapse group takes, (n_synapse_groups,)."""
    memory = chip.synapse_memory
    population = 1 if memory is None else memory.population_32_slots.count
    return np.where(image.groups.pop_type == 32, population, 1)


def out_slots(image: ChipImage, chip: ChipModel) -> np.ndarray:
    """Return the slots that each compartment's axons take if none are shared, (n_compartments,).

    Compartments of a population may share axons, see `block_amounts`.
    """
    paths = deliveries(image)
    n = image.n_compartments
    # Inputs from the host send over axons of their own, which take no room on a core.
    mine = paths.of(paths.source < n)
    slots = axon_slots(image, chip)[mine.group]
    return np.bincount(mine.source, weights=slots, minlength=n).astype(int)


def _share_lists(image: ChipImage) -> np.ndarray:
    """Return the compartments that share axons with an earlier one in a block, (n_compartments,).

    A compartment points to a list of axons, and names its atom in the population. Compartments
    that send to the same axons point to one list, if all axons belong to populations. Source:
    nengo-loihi, hardware/builder.py before commit e994804, where it writes these registers
    (axonMap, axonCfg) itself.
    """
    shares = np.zeros(image.n_compartments, dtype=bool)
    if image.groups.pop_type.any():
        known: set[tuple[int, bytes]] = set()
        block = image.compartment_block.tolist()
        for source, axons in _population_lists(image):
            key = (block[source], axons)
            shares[source] = key in known
            known.add(key)
    return shares


def _population_lists(image: ChipImage) -> Iterator[tuple[int, bytes]]:
    """Yield each compartment whose axons all belong to populations, and its axons, ascending."""
    paths = deliveries(image)
    paths = paths.of(paths.source < image.n_compartments)
    plain = np.zeros(image.n_compartments, dtype=bool)
    plain[paths.source[image.groups.pop_type[paths.group] == 0]] = True
    order = np.lexsort((paths.axon, paths.source))
    paths = paths.of(order[~plain[paths.source[order]]])
    first = np.flatnonzero(np.diff(paths.source, prepend=-1))
    ends = np.append(first, len(paths.axon)) * paths.axon.itemsize
    content = paths.axon.tobytes()  # slices of bytes compare faster than slices of arrays
    for source, (start, end) in zip(
        paths.source[first].tolist(), itertools.pairwise(ends.tolist()), strict=True
    ):
        yield source, content[start:end]


def layout(chip: ChipModel) -> SynapseLayout:
    """Return the chip's layout of lists; if it is not public, lists take their bits alone."""
    memory = chip.synapse_memory
    return (
        SynapseLayout()
        if memory is None
        else SynapseLayout(memory.word.count, memory.list_header.count)
    )


def list_formats(image: ChipImage) -> list[ListFormat]:
    """Return the format of each synapse group."""
    return [
        _list_format(image.manifest, image.format_of(group), near)
        for group, near in enumerate(is_consecutive(image))
    ]


def _list_format(manifest: Manifest, form: dict[str, int], consecutive: bool) -> ListFormat:
    # ``weight_bits`` and ``idx_bits`` are codes, for which the manifest lists the bits.
    width = manifest.weight_bits[form["weight_bits"]]
    width += form["delay_bits"] + form["tag_bits"]
    if form["compression"] == INDEXED or not consecutive:
        width += manifest.index_bits[form["idx_bits"]]
    # The register counts from 0; see `bits_per_axon` in nengo-loihi.
    return ListFormat(width, form["n_synapses"] + 1)


def is_consecutive(image: ChipImage) -> np.ndarray:
    """Return the groups whose rows reach targets 0, 1, 2 ... for each atom, (n_synapse_groups,)."""
    first = np.zeros(len(image.synapses), dtype=bool)
    # Atoms of a row are stored one after the other, and each counts its targets from 0 anew.
    first[_atom_starts(image)] = True
    expected = np.where(first, 0, np.roll(image.synapses.index, 1) + np.int16(1))
    row = np.searchsorted(
        image.rows.start, np.flatnonzero(image.synapses.index != expected), side="right"
    )
    group = np.searchsorted(image.groups.row_start, row - 1, side="right") - 1
    result: np.ndarray = np.bincount(group, minlength=len(image.groups)) == 0
    return result


def _atom_starts(image: ChipImage) -> np.ndarray:
    """Return the place of the first weight of each atom of all rows, except atoms without any."""
    atoms = image.rows.atoms
    number = np.arange(atoms.sum()) - np.repeat(np.cumsum(atoms) - atoms, atoms)
    length = np.repeat(row_lengths(image), atoms)
    result: np.ndarray = (np.repeat(image.rows.start[:-1], atoms) + number * length)[length > 0]
    return result


def list_bits(sizes: np.ndarray, form: ListFormat, memory: SynapseLayout) -> np.ndarray:
    """Return the bits of each row: lists of at most ``per_list`` synapses, in whole words."""
    full, rest = np.divmod(sizes, form.per_list)
    # Every list begins a word of its own and repeats the header, so each list is rounded up.
    words = full * _words(np.asarray(form.per_list * form.width_bits), memory)
    words += np.where(rest > 0, _words(rest * form.width_bits, memory), 0)
    bits: np.ndarray = words * memory.word_bits
    return bits


def _words(payload_bits: np.ndarray, memory: SynapseLayout) -> np.ndarray:
    # Rounded up to whole words.
    return -(-(payload_bits + memory.header_bits) // memory.word_bits)


def _group_bits(image: ChipImage, chip: ChipModel) -> list[int]:
    if chip.soft_memory is not None:
        return list(map(int, soft_row_bits(image)))
    sizes, rows = np.diff(image.rows.start), itertools.pairwise(image.groups.row_start)
    memory = layout(chip)
    return [
        int(list_bits(sizes[first:end], form, memory).sum())
        for (first, end), form in zip(rows, list_formats(image), strict=True)
    ]


def _profiles(image: ChipImage) -> Iterator[dict[str, int]]:
    """Yield the number of profiles of each kind on each core."""
    # Registers hold the values of one profile together, so distinct combinations count.
    settings = np.stack([getattr(image.compartments, name) for name in PROFILE])
    compartments = positions(image.compartment_core, image.n_cores)
    groups = positions(image.group_core, image.n_cores)
    for mine, ours in zip(compartments, groups, strict=True):
        yield {
            "compartment_profiles": np.unique(settings[:, mine], axis=1).shape[1],
            "threshold_profiles": np.unique(image.compartments.vth[mine]).size,
            "synapse_profiles": len(np.unique(image.groups.format[ours], axis=0)),
        }
