"""Writer of memory images for soft cores; its error lists every rule that an image breaks."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from spikeport.backends.native.contacts import contacts_of, pairs_of
from spikeport.backends.native.rows import KernelRows, rows_of
from spikeport.backends.softcore.memory import (
    AXONS,
    LOG_COMPARTMENTS,
    PROFILES,
    ROW_BITS,
    ROW_WORDS,
    THRESHOLDS,
    CoreMemory,
    MemoryImage,
    core_bits,
)
from spikeport.backends.softcore.rows import encoded
from spikeport.compile.check import rules
from spikeport.compile.check.verify import verify_learning
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import DELAY_BITS, STATE_BITS
from spikeport.compile.image.soft_rows import WORD_BITS
from spikeport.compile.image.tables import flat, offsets, positions
from spikeport.errors import BackendError
from spikeport.hardware_models import chip as chips

LARGEST_CHIP = "softcore-ecp5-85f"
"""The largest chip of soft cores: no other has a feature that it lacks."""
MOST_UNIT = 6
"""Weights that nengo-loihi discretised are multiples of 2^6."""


class Message(NamedTuple):
    """The row that a spike adds, and its core."""

    core: int
    row: int


def soft_chip_of(image: ChipImage) -> str:
    """Return the chip that an image was compiled for; `LARGEST_CHIP` if it has no soft cores."""
    name = image.manifest.chip
    is_soft = name in chips.names() and chips.get(name).soft_memory is not None
    return name if is_soft else LARGEST_CHIP


def written(image: ChipImage, unit: int | None = None, cores: int = 1) -> MemoryImage:
    """Return the memory image of an image; equal images have equal memory images.

    Parameters
    ----------
    image : ChipImage
        The image.
    unit : int, optional
        Sums are in units of 2^unit; by default as large as the weights allow, at most 2^6.
    cores : int
        Cores of the chip, if it has more than the image uses.

    Raises
    ------
    BackendError
        If the image breaks rules of the soft core; the message names all of them. If ``unit`` is
        larger than the weights allow.
    """
    image = image.checked
    refuse(_unheld(image))
    rows = rows_of(image)
    unit = min(rows.common_shift, MOST_UNIT) if unit is None else unit
    if unit > rows.common_shift:
        raise BackendError(
            f"sums in units of 2^{unit} would cut weights, which are multiples of "
            f"2^{rows.common_shift}; cure: a chip with the unit {rows.common_shift} or less"
        )
    table = RowTable(image, rows, unit)
    lists = _messages_of_sources(image, table)
    order = np.argsort(image.compartment_core, kind="stable")
    bits, memories = core_bits(max(cores, image.n_cores)), []
    broken: list[str] = []
    for number, mine in enumerate(positions(image.compartment_core, image.n_cores)):
        core = _core(image, mine, [lists[i] for i in mine], table.words(number), bits)
        memories.append(core)
        broken += _too_large(image.cores[number], core)
    refuse(broken)
    host = lists[image.n_compartments :]
    messages = np.array([m for one in host for m in one], dtype=np.int64).reshape(-1, 2)
    return MemoryImage(tuple(memories), offsets(map(len, host)), messages, order, unit, bits)


class RowTable:
    """The rows of all cores: equal rows of a core are stored once.

    Parameters
    ----------
    image : ChipImage
        The image.
    rows : KernelRows
        Its rows.
    unit : int
        The unit of sums.
    """

    def __init__(self, image: ChipImage, rows: KernelRows, unit: int) -> None:
        self._rows, self._unit = rows, unit
        self._contacts = contacts_of(image)
        self._words: list[list[np.ndarray]] = [[] for _ in range(image.n_cores)]
        self._known: list[dict[bytes, int]] = [{} for _ in range(image.n_cores)]
        self._sizes = [0] * image.n_cores
        self._local = image.compartment_place

    def messages(self, contact: int) -> list[Message]:
        """Return the messages of a spike along a contact: one for each part of its weights."""
        if not self._contacts.used[contact]:
            return []
        core, number = int(self._contacts.core[contact]), self._contacts.row[contact]
        begin, end = self._rows.start[number], self._rows.start[number + 1]
        first = int(self._local[self._contacts.first[contact]]) if end > begin else 0
        parts = encoded(
            first, self._rows.indices[begin:end], self._rows.weights[begin:end], self._unit
        )
        return [Message(core, self._address(core, part)) for part in parts]

    def _address(self, core: int, words: np.ndarray) -> int:
        known, key = self._known[core], words.tobytes()
        if key not in known:
            known[key] = self._sizes[core]
            self._words[core].append(words)
            self._sizes[core] += len(words)
        return known[key]

    def words(self, core: int) -> np.ndarray:
        """Return the words of a core's rows."""
        return flat(self._words[core]).astype(np.uint64)


def _messages_of_sources(image: ChipImage, table: RowTable) -> list[list[Message]]:
    """Return the messages of a spike of each source: compartments, then those of the host."""
    pairs = pairs_of(image)
    of_contact = {k: table.messages(k) for k in np.unique(pairs.contact).tolist()}
    lists: list[list[Message]] = [[] for _ in range(image.n_sources)]
    for source, contact in zip(pairs.source.tolist(), pairs.contact.tolist(), strict=True):
        lists[source] += of_contact[contact]
    return lists


def _core(
    image: ChipImage,
    mine: np.ndarray,
    lists: Sequence[Sequence[Message]],
    rows: np.ndarray,
    bits: int,
) -> CoreMemory:
    """Return the memories of a core with these compartments; core numbers have ``bits`` bits."""
    constants = image.compartments
    # nengo-loihi's currents lose 1/4096 more than their decay says; voltages do not.
    keep_u, keep_v = 4095 - constants.decay_u[mine], 4096 - constants.decay_v[mine]
    # The fields of `CoreMemory.profiles`: packed first, so that equal profiles are equal numbers.
    packed = constants.refract_delay[mine] << 25 | keep_v << 12 | keep_u
    profiles, profile = np.unique(packed, return_inverse=True)
    thresholds, threshold = np.unique(constants.vth[mine], return_inverse=True)
    sizes = np.array([len(one) for one in lists], dtype=np.int64)
    axons = np.array([m.core << ROW_BITS | m.row for one in lists for m in one], dtype=np.int64)
    # Mark the last axon of each compartment that has axons.
    axons[np.cumsum(sizes)[sizes > 0] - 1] |= 1 << (ROW_BITS + bits)
    block = image.compartment_block[mine[:1]]
    vmax = image.blocks.vmax[block]
    # Where the bounds cross, NumPy's clip returns the upper one at any voltage.
    vmin = np.minimum(image.blocks.vmin[block], vmax)
    voltages = _field(vmin) << STATE_BITS | _field(vmax)
    words = (sizes > 0).astype(np.int64) << 46
    # The address of a compartment's first axon. An empty list behind a full table would have an
    # address that runs over into the bit above.
    words |= (np.cumsum(sizes) - sizes) % AXONS << 34
    words |= threshold.astype(np.int64) << 29 | profile.astype(np.int64) << 24
    words |= _field(constants.bias[mine])
    contents = (words, axons, rows, profiles, _field(thresholds), voltages)
    return CoreMemory(*(np.asarray(one).astype(np.uint64) for one in contents))


def _field(values: np.ndarray) -> np.ndarray:
    """Return values as fields of 24 bits."""
    return values.astype(np.int64) & ((1 << STATE_BITS) - 1)


def _unheld(image: ChipImage) -> Iterator[str]:
    """Yield the reasons, other than its size, why a soft core cannot run an image."""
    if image.compartments.enable_noise.any():
        yield (
            f"{int(image.compartments.enable_noise.sum()):,} compartments have noise, and a soft "
            "core has no random numbers; cure: run it on native"
        )
    yield from map(str, verify_learning(image, chips.get(LARGEST_CHIP)))
    voltages = np.stack([image.blocks.vmin, image.blocks.vmax], axis=1)
    for core, name in enumerate(image.cores):
        n = len(np.unique(voltages[image.blocks.core == core], axis=0))
        if n > 1:
            yield str(rules.get("SP108").broken(name, f"{n} of clipping"))
    yield from _out_of_range(image)


def _out_of_range(image: ChipImage) -> Iterator[str]:
    half = 1 << (STATE_BITS - 1)
    constants, blocks = image.compartments, image.blocks
    for name, values, low, high in (
        ("bias", constants.bias, -half, half - 1),
        ("threshold", constants.vth, -half, half - 1),
        ("vmin", blocks.vmin, -half, half - 1),
        ("vmax", blocks.vmax, -half, half - 1),
        ("refractory delay", constants.refract_delay, 0, (1 << DELAY_BITS) - 1),
    ):
        outside = values[(values < low) | (values > high)]
        if len(outside):
            yield f"{name} {outside[0]:,}: registers hold {low:,} to {high:,}; cure: scale it"


def _too_large(name: str, core: CoreMemory) -> Iterator[str]:
    """Yield the memories of a core that are too small."""
    for rule, used, limit in (
        ("SP103", len(core.constants), 1 << LOG_COMPARTMENTS),
        ("SP101", len(core.axons), AXONS),
        ("SP104", WORD_BITS * len(core.rows), WORD_BITS * ROW_WORDS),
        ("SP105", len(core.profiles), PROFILES),
        ("SP106", len(core.thresholds), THRESHOLDS),
    ):
        if used > limit:
            parts = -(-used // limit)
            yield str(rules.get(rule).broken(name, f"{used:,}", f"{limit:,}", parts=parts))


def refuse(reasons: Iterable[str]) -> None:
    """Raise a BackendError that names all reasons, if there are any."""
    if broken := "\n".join(f"  {one}" for one in reasons):
        raise BackendError(f"the soft core cannot hold the image:\n{broken}")
