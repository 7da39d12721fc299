"""The use of each resource by a placement, against the chip's limits."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from spikeport.hardware_models.chip import ChipModel, SoftMemory
from spikeport.hardware_models.topology import chips_used


class CoreUse(NamedTuple):
    """The use of each resource by one core."""

    label: str
    compartments: int
    in_axons: int
    out_axons: int
    synapse_bits: int
    compartment_profiles: int
    threshold_profiles: int
    synapse_profiles: int


class Usage(NamedTuple):
    """The use of a resource by an object, a core or the chip, and the most it may use.

    ``limit`` is None where it is not public.
    """

    object: str
    resource: str
    used: int
    limit: int | None
    unit: str

    @property
    def exceeded(self) -> bool:
        """True if more is used than there is."""
        return self.limit is not None and self.used > self.limit


class Limit(ABC):
    """A limit of the chip, on the resource it names."""

    resource: str

    @abstractmethod
    def usages(self, cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
        """Return the use of the resource by every object that the limit holds for."""

    @abstractmethod
    def total(self, cores: Sequence[CoreUse], chip: ChipModel) -> Usage:
        """Return the use of the resource by all cores against what all cores of the chip have."""


@dataclass(frozen=True)
class Cores(Limit):
    """The limit on cores: used = number of cores in use, limit = cores per chip * chips."""

    resource: str = "cores"

    def usages(self, cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
        """See `Limit.usages`."""
        return [self.total(cores, chip)]

    def total(self, cores: Sequence[CoreUse], chip: ChipModel) -> Usage:
        """See `Limit.total`."""
        return Usage(chip.name, self.resource, len(cores), chip.n_cores, "1")


@dataclass(frozen=True)
class Chips(Limit):
    """The limit on chips: used = number of chips with cores in use; `Cores` checks the limit."""

    resource: str = "chips"

    def usages(self, cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
        """See `Limit.usages`."""
        return []

    def total(self, cores: Sequence[CoreUse], chip: ChipModel) -> Usage:
        """See `Limit.total`."""
        used = chips_used(len(cores), chip)
        return Usage(chip.name, self.resource, used, chip.limits.chips.count, "1")


@dataclass(frozen=True)
class PerCore(Limit):
    """A limit of each core: used = amount of the resource on it, limit = the most it can hold.

    Parameters
    ----------
    resource : str
        A field of `CoreUse` and of the chip's limits.
    unit : str
        The unit both are counted in.
    """

    resource: str
    unit: str = "1"

    def usages(self, cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
        """See `Limit.usages`."""
        limit = self.of_a_core(chip)
        return [
            Usage(core.label, self.resource, getattr(core, self.resource), limit, self.unit)
            for core in cores
        ]

    def total(self, cores: Sequence[CoreUse], chip: ChipModel) -> Usage:
        """See `Limit.total`."""
        used, limit = sum(getattr(core, self.resource) for core in cores), self.of_a_core(chip)
        on_board = None if limit is None else limit * chip.n_cores
        return Usage(chip.name, self.resource, used, on_board, self.unit)

    def of_a_core(self, chip: ChipModel) -> int | None:
        """Return the most that a core can hold; None where it is not public."""
        figure = getattr(chip.limits, self.resource)
        return None if figure is None else figure.count


@dataclass(frozen=True)
class SharedMemory(Limit):
    """The limit on shared memory: used = sum of the blocks that a chip's cores take.

    See `spikeport.hardware_models.chip.SoftMemory`. Each chip of a board has its own blocks.
    """

    resource: str = "memory_blocks"

    def usages(self, cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
        """See `Limit.usages`."""
        if chip.limits.chips.count == 1:
            return [self.total(cores, chip)]
        most = _pool(chip).blocks.count
        return [
            Usage(f"{chip.name}, chip {number}", self.resource, _blocks(mine, chip), most, "1")
            for number, mine in enumerate(_by_chip(cores, chip))
        ]

    def total(self, cores: Sequence[CoreUse], chip: ChipModel) -> Usage:
        """See `Limit.total`."""
        used = sum(_blocks(mine, chip) for mine in _by_chip(cores, chip))
        most = _pool(chip).blocks.count * chip.limits.chips.count
        return Usage(chip.name, self.resource, used, most, "1")


def _pool(chip: ChipModel) -> SoftMemory:
    """Return the memory that a chip's cores share."""
    assert chip.soft_memory is not None  # without one there is no such limit
    return chip.soft_memory


def _by_chip(cores: Sequence[CoreUse], chip: ChipModel) -> list[Sequence[CoreUse]]:
    """Return the cores of each chip in use; a single chip has them all, also if too many."""
    if chip.limits.chips.count == 1:
        return [cores]
    n = chip.limits.cores.count
    return [cores[first : first + n] for first in range(0, len(cores), n)]


def _blocks(cores: Sequence[CoreUse], chip: ChipModel) -> int:
    """Return the blocks that cores of one chip take, with those of its port."""
    pool = _pool(chip)
    # Axons and rows do not share a block, and the rest of a last block is lost.
    used = 0 if pool.port is None else pool.port.count
    for core in cores:
        used += -(-core.synapse_bits // pool.block.count)
        if pool.core is not None:
            used += pool.core.count + -(-core.out_axons // pool.axon_step.count)
    return used


LIMITS: tuple[Limit, ...] = (
    Cores(),
    Chips(),
    PerCore("compartments"),
    PerCore("in_axons"),
    PerCore("out_axons"),
    PerCore("synapse_bits", "bit"),
    PerCore("compartment_profiles"),
    PerCore("threshold_profiles"),
    PerCore("synapse_profiles"),
)


def usages(cores: Sequence[CoreUse], chip: ChipModel) -> list[Usage]:
    """Return the use of every resource by every object, whether within its limit or not."""
    return [usage for limit in _limits(chip) for usage in limit.usages(cores, chip)]


def totals(cores: Sequence[CoreUse], chip: ChipModel) -> dict[str, Usage]:
    """Return the use of every resource by all cores together, by resource."""
    return {limit.resource: limit.total(cores, chip) for limit in _limits(chip)}


def _limits(chip: ChipModel) -> tuple[Limit, ...]:
    """Return the limits that a chip has; few chips share memory."""
    return LIMITS if chip.soft_memory is None else (*LIMITS, SharedMemory())


def limits_of_a_core(chip: ChipModel) -> dict[str, int | None]:
    """Return the most that a core can hold, by resource; None where it is not public."""
    return {one.resource: one.of_a_core(chip) for one in LIMITS if isinstance(one, PerCore)}
