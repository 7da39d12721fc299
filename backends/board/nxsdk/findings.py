"""Findings: problems of an image in a placement on a real chip, each with a cure.

Their cause is nengo-loihi's hardware half, not the chip, so they are not rules of a compile: for an
image that fits the chip, nengo-loihi may still fail to write it, or to read its values as they are.
"""

from collections.abc import Callable, Iterator

import numpy as np

from spikeport.backends.board.nxsdk.model import NOISE, Placement
from spikeport.backends.board.nxsdk.traps import (
    BASES,
    DEFAULT_SPIKES,
    DUMMIES,
    INDICES,
    LEARNERS,
    MOST_BASE,
    MOST_PROFILES,
    MOST_THRESHOLDS,
    NOISES,
    PHANTOMS,
    POPULATIONS,
    PROFILES,
    RANGES,
    REFRACTORY,
    SCATTERED,
    SEEDS,
    SHUTDOWNS,
    SPIKE_VOLTAGE,
    SPIKES,
    THRESHOLDS,
    Finding,
)
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import deliveries
from spikeport.compile.image.tables import part
from spikeport.compile.image.usage import INDEXED, PROFILE, is_consecutive


def findings(image: ChipImage, placement: Placement) -> list[Finding]:
    """Return the traps that an image is in with a placement."""
    return [found for look in LOOKS for found in look(image, placement)]


def _profiles(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield cores with as many profiles as the chip has, one more than the builder takes."""
    core = placement.core[image.compartment_block]
    for trap, names, most in (
        (THRESHOLDS, ("vth",), MOST_THRESHOLDS),
        (PROFILES, PROFILE, MOST_PROFILES),
    ):
        values = np.stack([getattr(image.compartments, name) for name in names])
        for number in np.unique(core):
            n = np.unique(values[:, core == number], axis=1).shape[1]
            if n > most:
                used = f"{n}, nengo-loihi's builder takes up to {most}"
                yield Finding(trap, f"core {number}", used)


def _shared(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield settings that differ among a core's blocks, though a core has only one of each."""
    noisy = np.bincount(image.compartment_block, image.compartments.enable_noise, image.n_blocks)
    for number, blocks in enumerate(placement.blocks_of):
        for trap, names, mine in (
            # Settings of noise do not matter if noise is off.
            (NOISES, NOISE, blocks[noisy[blocks] != 0]),
            (RANGES, ("vmin", "vmax"), blocks),
        ):
            columns = [getattr(image.blocks, name)[mine] for name in names]
            n = np.unique(np.stack(columns), axis=1).shape[1]
            if n > 1:
                yield Finding(
                    trap, f"core {number}", f"{n} different settings, but a core has only 1"
                )


def _populations(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    sends = (image.routes.from_input == 0) & (image.groups.pop_type[image.routes.group] != 0)
    for number, blocks in enumerate(placement.blocks_of):
        if len(blocks) > 1 and np.isin(blocks, image.routes.source[sends]).any():
            yield Finding(POPULATIONS, f"core {number}", f"{len(blocks)} blocks, at most 1")


def _learners(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    core = placement.core[image.groups.block]
    for number in np.unique(core[image.learns]):
        n = int((core == number).sum())
        blocks = int((placement.core == number).sum())
        if n > 1 or blocks > 1:
            used = f"{n} groups and {blocks} blocks, limit 1 and 1"
            yield Finding(LEARNERS, f"core {number}", used)


def _dummies(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield groups that end in an axon without synapses: nengo-loihi miscounts the next group."""
    for number, blocks in enumerate(placement.blocks_of):
        mine = [g for b in blocks for g in np.flatnonzero(image.groups.block == b)]
        # No group follows the last group of a core.
        for group in mine[:-1]:
            if _ends_in_nothing(image, group):
                label = image.manifest.groups[group].label
                yield Finding(DUMMIES, f"core {number}, {label}", "followed by a group")


def _ends_in_nothing(image: ChipImage, group: np.integer) -> bool:
    axons = part(image.groups.axon_start, group)
    if axons.start == axons.stop:
        return True
    row = image.groups.row_start[group] + image.in_axons.row[axons.stop - 1]
    size = image.rows.start[row + 1] - image.rows.start[row]
    return bool(image.in_axons.base[axons.stop - 1] < 0 or size == 0)


def _bases(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    for group in range(len(image.groups)):
        most = int(image.in_axons.base[part(image.groups.axon_start, group)].max(initial=0))
        if most > MOST_BASE:
            label = image.manifest.groups[group].label
            yield Finding(BASES, label, f"{most}, nengo-loihi's builder takes up to {MOST_BASE}")


def axons_by_source(image: ChipImage) -> np.ndarray:
    """Return the number of axons that each of the host's sources reaches, (n_inputs,)."""
    sources = deliveries(image).source - image.n_compartments
    return np.bincount(sources[sources >= 0], minlength=image.n_inputs)


def host_axons(image: ChipImage) -> int:
    """Return the number of axons that the host's sources reach: the most spikes of a step.

    Sources that spike more than once in a step, as in files of events, may send more.
    """
    return int(axons_by_source(image).sum())


def _spikes(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    if (n := host_axons(image)) > DEFAULT_SPIKES:
        used = f"up to {n:,}; by default nengo-loihi sends {DEFAULT_SPIKES} and drops the others"
        yield Finding(SPIKES, "all inputs", used)


def spikes_read(image: ChipImage) -> np.ndarray:
    """Return the compartments whose spikes outputs read, (n,)."""
    keys = np.array([entry.key == "spiked" for entry in image.manifest.outputs], dtype=bool)
    return np.unique(image.reads.compartment[np.repeat(keys, np.diff(image.outputs.start))])


def _phantoms(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    mine, state = spikes_read(image), image.compartments
    n = int((state.vth[mine] >= SPIKE_VOLTAGE * state.refract_delay[mine]).sum())
    if n:
        used = f"a voltage of {SPIKE_VOLTAGE} x refractory delay is read as a spike"
        yield Finding(PHANTOMS, f"{n:,} compartments whose spikes are read", used)


def _indices(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield rows whose format was chosen for targets other than the written ones."""
    moved = _moved(image, placement)[image.groups.block]
    scattered = ~moved & ~is_consecutive(image) & ~indexed(image)
    rows = np.diff(image.groups.row_start)
    for trap, where, mine, used in (
        (INDICES, "blocks that share a core", moved, "moved by the blocks before theirs"),
        (
            SCATTERED,
            "formats that store no targets",
            scattered,
            "whose targets are not consecutive from 0",
        ),
    ):
        if n := int(rows[mine].sum()):
            yield Finding(trap, where, f"{n:,} of {rows.sum():,} weight rows, {used}")


def _moved(image: ChipImage, placement: Placement) -> np.ndarray:
    """Return the blocks that do not begin at compartment 0 of their core, (n_blocks,)."""
    moved = np.zeros(image.n_blocks, dtype=bool)
    for blocks in placement.blocks_of:
        moved[blocks[1:]] = True
    return moved


def indexed(image: ChipImage) -> np.ndarray:
    """Return the groups whose format stores a target with every weight, (n_groups,)."""
    column = image.manifest.synapse_format.index("compression")
    result: np.ndarray = image.groups.format[:, column] == INDEXED
    return result


def _seeds(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    if n := int(image.compartments.enable_noise.sum()):
        yield Finding(SEEDS, f"{n:,} compartments", "nengo-loihi does not set the seed of noise")


def _refractory(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield blocks with several delays: snips detect spikes by the first compartment's delay."""
    for block in np.unique(image.compartment_block[spikes_read(image)]):
        delays = np.unique(image.compartments.refract_delay[part(image.blocks.start, block)])
        if len(delays) > 1:
            label = image.manifest.blocks[block].label
            used = f"{len(delays)} different delays, but snips detect spikes by only 1"
            yield Finding(REFRACTORY, label, used)


def _shutdowns(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield the way an answer to a step may end in -1, which nengo-loihi takes for a shutdown."""
    # An answer ends with the words of the last output.
    for last in image.manifest.outputs[-1:]:
        value = "32 spikes at once" if last.key == "spiked" else f"a {last.key} of -1"
        rest = "-1 in the unused rest of the last packet, which the chip's snip never sets"
        yield Finding(SHUTDOWNS, "the end of the last output", f"{value}, or {rest}")


LOOKS: tuple[Callable[[ChipImage, Placement], Iterator[Finding]], ...] = (
    *(_profiles, _shared, _populations, _learners, _dummies),
    *(_bases, _spikes, _phantoms, _indices, _seeds, _refractory, _shutdowns),
)
"""The functions that look for findings in an image."""
