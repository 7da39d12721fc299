"""Loads of blocks and capacities of cores, in the form that packing needs.

Amounts are added; sets of profiles are united. Settings that all blocks of a core must share
(clipping, noise, the traces of learning) are profiles of which a core has one.
"""

from collections.abc import Iterable, Sequence
from operator import add, or_
from typing import NamedTuple

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import positions
from spikeport.compile.image.usage import AMOUNTS, PROFILE, block_amounts, list_formats
from spikeport.hardware_models.chip import ChipModel

PROFILES = ("compartment_profiles", "threshold_profiles", "synapse_profiles")
SHARED = ("clipping", "noise", "learning")


class Load(NamedTuple):
    """The load of a block, of a part of a block, or of several blocks together.

    ``amounts`` follow `AMOUNTS`; ``profiles`` follow `PROFILES` and `SHARED`, each a bit mask with
    one bit for every profile of the image.
    """

    amounts: tuple[int, ...] = (0,) * len(AMOUNTS)
    profiles: tuple[int, ...] = (0,) * len(PROFILES + SHARED)

    def joined(self, other: "Load") -> "Load":
        """Return the load of both together."""
        return Load(
            tuple(map(add, self.amounts, other.amounts)),
            tuple(map(or_, self.profiles, other.profiles)),
        )


class Capacity(NamedTuple):
    """The capacity of a core: of every amount, and the number of profiles of every kind."""

    amounts: tuple[float, ...]
    profiles: tuple[float, ...]

    def holds(self, load: Load) -> bool:
        """Return whether a core has room for a load."""
        return all(a <= b for a, b in zip(load.amounts, self.amounts, strict=True)) and all(
            mask.bit_count() <= n for mask, n in zip(load.profiles, self.profiles, strict=True)
        )

    def nth_part(self, n: int) -> "Capacity":
        """Return the n-th part of every amount; profiles can be shared, and stay."""
        return Capacity(tuple(amount / n for amount in self.amounts), self.profiles)

    def fill(self, load: Load) -> float:
        """Return the share of the scarcest resource that a load takes."""
        shares = [a / b for a, b in zip(load.amounts, self.amounts, strict=True)]
        # Settings in `SHARED` are left out: a core has one of each, so that any block would fill
        # them.
        kinds = list(zip(load.profiles, self.profiles, strict=True))[: len(PROFILES)]
        return max(*shares, *(mask.bit_count() / n for mask, n in kinds))


def capacity(chip: ChipModel) -> Capacity:
    """Return the capacity of a core of a chip."""
    amounts = tuple(chip.limits.most(name) for name in AMOUNTS)
    profiles = tuple(chip.limits.most(name) for name in PROFILES)
    return Capacity(amounts, profiles + (1,) * len(SHARED))


def block_loads(image: ChipImage, chip: ChipModel) -> list[Load]:
    """Return the load of each block."""
    masks = ProfileMasks(image)
    return [
        Load(tuple(amounts), masks.of(b, 0, None, masks.groups[b]))
        for b, amounts in enumerate(block_amounts(image, chip).tolist())
    ]


def core_loads(image: ChipImage, chip: ChipModel) -> list[Load]:
    """Return the load of the blocks of each core together."""
    blocks: list[list[Load]] = [[] for _ in range(image.n_cores)]
    for core, load in zip(image.blocks.core, block_loads(image, chip), strict=True):
        blocks[core].append(load)
    return [together(loads) for loads in blocks]


def together(loads: Iterable[Load]) -> Load:
    """Return the load of several loads on one core."""
    total = Load()
    for load in loads:
        total = total.joined(load)
    return total


class ProfileMasks:
    """The profiles of an image, numbered.

    ``groups`` lists the synapse groups of each block, ``forms`` how each group is stored.
    """

    def __init__(self, image: ChipImage) -> None:
        self._image = image
        self.groups = positions(image.groups.block, image.n_blocks)
        self.forms = list_formats(image)
        self._compartment = _numbered(
            np.stack([getattr(image.compartments, name) for name in PROFILE], axis=1)
        )
        self._threshold = _numbered(image.compartments.vth)
        self._format = _numbered(image.groups.format)
        self._learning = _numbered(image.groups.learning)
        self._clipping = _numbered(np.stack([image.blocks.vmin, image.blocks.vmax], axis=1))
        noise = ("noise_offset", "noise_exp", "noise_at_membrane")
        self._noise = _numbered(np.stack([getattr(image.blocks, name) for name in noise], axis=1))

    def of(
        self, block: int, first: int, end: int | None, groups: Sequence[int] | np.ndarray
    ) -> tuple[int, ...]:
        """Return the masks of a stretch of a block that some of its synapse groups reach."""
        start, stop = self._image.blocks.start[block : block + 2]
        mine = slice(start + first, stop if end is None else start + end)
        # Settings of noise do not matter if no neuron is noisy, and then fit any other settings.
        noisy = self._image.compartments.enable_noise[mine].any()
        return (
            _mask(self._compartment[mine]),
            _mask(self._threshold[mine]),
            _mask(self._format[groups]),
            1 << int(self._clipping[block]),
            1 << int(self._noise[block]) if noisy else 0,
            _mask(self._learning[groups]),
        )


def _numbered(values: np.ndarray) -> np.ndarray:
    """Return the number of each value, or row of values, among the distinct ones."""
    number = np.zeros(len(values), dtype=int)
    for column in np.atleast_2d(values.T):  # much faster than np.unique over rows
        _, place = np.unique(column, return_inverse=True)
        # Numbered anew with each column, so that the products stay small enough for an integer.
        number = np.unique(number * (place.max(initial=0) + 1) + place, return_inverse=True)[1]
    return number


def _mask(numbers: np.ndarray) -> int:
    # Distinct numbers: equal ones would carry into the next bit.
    return sum(1 << number for number in np.flatnonzero(np.bincount(numbers)).tolist())
