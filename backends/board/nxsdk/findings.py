"""Findings: what stands between an image in a placement and a real chip, each with a cure.

They are of nengo-loihi's hardware half, not of the chip, so they are no rules of a compile: an image
that fits the chip can still not be written, or be written and not read back as it is.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.nxsdk.half import MOST_THRESHOLDS
from spikeport.backends.board.nxsdk.model import NOISE, Placement
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part

MOST_BASE = 256
"""The largest compartment that targets may count from: nengo-loihi's builder asserts it."""
DEFAULT_SPIKES = 50
"""The default of nengo-loihi's ``snip_max_spikes_per_step``."""
SPIKE_VOLTAGE = 128
"""Snips take a voltage of this times the refractory delay for a spike."""
SINGLE = "one block a core: compile with --passes unpacked"


class Trap(NamedTuple):
    """What can go wrong: its id, its name, whether nengo-loihi refuses it, and the cure."""

    id: str
    name: str
    refused: bool
    cure: str


THRESHOLDS = Trap("NX01", "threshold profiles of a core", False, SINGLE)
NOISES = Trap("NX02", "noise settings of a core", True, SINGLE)
RANGES = Trap("NX03", "voltage ranges of a core", True, SINGLE)
POPULATIONS = Trap("NX04", "population axons of a shared core", True, SINGLE)
LEARNERS = Trap("NX05", "groups of synapses on a core that learns", True, SINGLE)
DUMMIES = Trap("NX06", "axon without synapses at the end of a group", True, SINGLE)
BASES = Trap("NX07", "compartment that targets count from", True, "convolve fewer neurons at once")
SPIKES = Trap(
    "NX08",
    "host spikes in a step",
    False,
    "snip_max_spikes_per_step of that number, as `board serve --machine nxsdk` sets it",
)
PHANTOMS = Trap(
    "NX09",
    "phantom spikes",
    False,
    "read decoded values (a Probe of the ensemble) in place of spikes, or a longer filter",
)
INDICES = Trap("NX10", "not provable offline: index bits", False, SINGLE)
SEEDS = Trap("NX11", "noise without a seed", False, "compare spikes with noise off, rates with it")
TRAPS = (
    *(THRESHOLDS, NOISES, RANGES, POPULATIONS, LEARNERS, DUMMIES),
    *(BASES, SPIKES, PHANTOMS, INDICES, SEEDS),
)


class Finding(NamedTuple):
    """A trap that an image is in, where, and what is used against the limit."""

    trap: Trap
    where: str
    used: str

    def __str__(self) -> str:
        verb = "refused: " if self.trap.refused else ""
        return (
            f"{self.trap.id} {verb}{self.trap.name}: {self.where}: {self.used}; "
            f"cure: {self.trap.cure}"
        )


def findings(image: ChipImage, placement: Placement) -> list[Finding]:
    """Return the traps that an image is in, if it is placed so."""
    return [found for look in LOOKS for found in look(image, placement)]


def _thresholds(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    core = placement.core[image.compartment_block]
    for number in range(int(core.max()) + 1):
        n = np.unique(image.compartments.vth[core == number]).size
        if n > MOST_THRESHOLDS:
            used = f"{n}, nengo-loihi's builder takes {MOST_THRESHOLDS}"
            yield Finding(THRESHOLDS, f"core {number}", used)


def _shared(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield settings that blocks of a core have apart, though a core has them once."""
    noisy = np.bitwise_or.reduceat(image.compartments.enable_noise, image.blocks.start[:-1])
    for number, blocks in enumerate(placement.blocks_of):
        for trap, names, mine in (
            (NOISES, NOISE, blocks[noisy[blocks] != 0]),
            (RANGES, ("vmin", "vmax"), blocks),
        ):
            columns = [getattr(image.blocks, name)[mine] for name in names]
            n = np.unique(np.stack(columns), axis=1).shape[1]
            if n > 1:
                yield Finding(trap, f"core {number}", f"{n} different ones, a core has 1")


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
            used = f"{n} groups of {blocks} blocks, 1 of 1 can learn"
            yield Finding(LEARNERS, f"core {number}", used)


def _dummies(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield groups that end in an axon of nothing, after which nengo-loihi cannot count on."""
    core = placement.core[image.groups.block]
    for number, blocks in enumerate(placement.blocks_of):
        mine = [g for b in blocks for g in np.flatnonzero(image.groups.block == b)]
        for group in mine[:-1]:
            if _ends_in_nothing(image, group):
                label = image.manifest.groups[group].label
                yield Finding(DUMMIES, f"core {core[group]}, {label}", "followed by a group")


def _ends_in_nothing(image: ChipImage, group: int) -> bool:
    axons = part(image.groups.axon_start, group)
    row = image.groups.row_start[group] + image.in_axons.row[axons.stop - 1]
    size = image.rows.start[row + 1] - image.rows.start[row]
    return bool(image.in_axons.base[axons.stop - 1] < 0 or size == 0)


def _bases(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    for group in range(len(image.groups)):
        most = int(image.in_axons.base[part(image.groups.axon_start, group)].max(initial=0))
        if most > MOST_BASE:
            label = image.manifest.groups[group].label
            yield Finding(BASES, label, f"{most}, nengo-loihi's builder takes {MOST_BASE}")


def host_axons(image: ChipImage) -> int:
    """Return the number of axons that all sources of the host reach: spikes of a step, at most."""
    mine = np.repeat(image.routes.from_input == 1, np.diff(image.routes.start))
    return int((image.out_axons.axon[mine] >= 0).sum())


def _spikes(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    if (n := host_axons(image)) > DEFAULT_SPIKES:
        used = f"up to {n:,}; by default nengo-loihi sends {DEFAULT_SPIKES} and drops the others"
        yield Finding(SPIKES, "all inputs", used)


def _phantoms(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    spikes = [o for o, entry in enumerate(image.manifest.outputs) if entry.key == "spiked"]
    read = [image.reads.compartment[part(image.outputs.start, output)] for output in spikes]
    mine = np.unique(np.concatenate(read)) if read else np.zeros(0, dtype=int)
    state = image.compartments
    n = int((state.vth[mine] >= SPIKE_VOLTAGE * state.refract_delay[mine]).sum())
    if n:
        used = f"a voltage of {SPIKE_VOLTAGE} x refractory delay is read as a spike"
        yield Finding(PHANTOMS, f"{n:,} compartments whose spikes are read", used)


def _indices(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    """Yield rows whose targets are no run from 0, though their format stores no targets."""
    if placement.is_single:
        return
    order = np.argsort(placement.core, kind="stable")
    sizes = np.diff(image.blocks.start)[order]
    before = np.cumsum(sizes) - sizes
    first = np.array([before[placement.core[order] == core][0] for core in placement.core[order]])
    moved = np.zeros(image.n_blocks, dtype=bool)
    moved[order] = before > first
    n = int(np.diff(image.groups.row_start)[moved[image.groups.block]].sum())
    if n:
        used = f"targets of {n:,} of {len(image.rows):,} weight rows are moved by the blocks before"
        yield Finding(INDICES, f"{int(moved.sum())} blocks that share a core", used)


def _seeds(image: ChipImage, placement: Placement) -> Iterator[Finding]:
    if n := int(image.compartments.enable_noise.sum()):
        yield Finding(SEEDS, f"{n:,} compartments", "nengo-loihi does not set the seed of noise")


LOOKS: tuple[Callable[[ChipImage, Placement], Iterator[Finding]], ...] = (
    *(_thresholds, _shared, _populations, _learners, _dummies),
    *(_bases, _spikes, _phantoms, _indices, _seeds),
)
"""The looks at an image, in the order of ids."""
