"""A recording NxSDK: boards of registers that nengo-loihi's hardware half writes into.

It has only the names that nengo-loihi 1.1.0 calls; their meaning is inferred from nengo-loihi's
source alone. `spikeport.backends.board.nxsdk.package` builds a package ``nxsdk`` from them.
"""

import enum
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import NamedTuple, Protocol

import numpy as np

from spikeport.backends.board.nxsdk.registers import Bank, Register, SynapseMemory

BANKS = {
    "cxProfileCfg": 32,
    "vthProfileCfg": 8,
    "synapseFmt": 16,
    "stdpPreCfg": 4,
    "stdpPostCfg": 4,
    "stdpPreProfileCfg": 4,
    "stdpProfileCfg": 16,
    "stdpUcodeMem": 512,
    "cxCfg": 1024,
    "cxMetaState": 256,
    "synapseMap": 4096,
    "stdpPostState": 1024,
    "dendriteTimeState": 16,
    "timeState": 16,
}
"""Numbers of a core's registers, by name. Sources: Davies et al. 2018, and nengo-loihi's limits."""
FIRST_CORE_ID = 4
"""Ids of a chip's cores begin here: code that mistakes a core's number for its id then fails."""


class Contact(NamedTuple):
    """An output axon: a compartment's spikes reach an input axon of a core, as one of its atoms."""

    compartment: int
    chip_id: int
    core_id: int
    axon: int
    atom: int


class Core(Register):
    """The registers of a core; registers outside the banks are made when they are written."""

    def __init__(self, chip: "Chip", number: int) -> None:
        self.parent, self.id = chip, number + FIRST_CORE_ID
        self.contacts: list[Contact] = []
        self.synapses = SynapseMemory()
        self.__dict__.update({name: Bank(name, size) for name, size in BANKS.items()})

    def bank(self, name: str) -> Bank:
        """Return the registers of a name."""
        bank: Bank = self.__dict__[name]
        return bank

    @property
    def ids(self) -> tuple[int, int]:
        """The ids by which axons name the core: the id of its chip, and its own."""
        return self.parent.id, self.id

    @property
    def compartments(self) -> Bank:
        """The registers of compartments, by number; empty if the core is not used."""
        return self.bank("cxCfg")

    @property
    def n_registers(self) -> int:
        """Number of written registers: in banks, single registers, synapses and axons."""
        held = [one for one in vars(self).values() if isinstance(one, Bank | Register)]
        return (
            sum(len(one) if isinstance(one, Bank) else 1 for one in held)
            + len(self.synapses)
            + len(self.contacts)
        )

    def createDiscreteAxon(  # noqa: N802 (NxSDK's)
        self, srcCxId: int, dstChipId: int, dstCoreId: int, dstSynMapId: int
    ) -> None:
        """Record an axon."""
        self.contacts.append(Contact(int(srcCxId), dstChipId, dstCoreId, int(dstSynMapId), 0))

    def createPop32Axon(  # noqa: N802 (NxSDK's)
        self,
        popId: int,
        srcCxId: int,
        srcRelCxId: int,
        dstChipId: int,
        dstCoreId: int,
        dstSynMapId: int,
    ) -> None:
        """Record an axon of a population, whose spikes choose an atom."""
        atom = int(srcRelCxId)
        self.contacts.append(Contact(int(srcCxId), dstChipId, dstCoreId, int(dstSynMapId), atom))

    createPop16Axon = createPop32Axon  # noqa: N815 (NxSDK's)


class Chip:
    """A chip of a board, with as many cores as are in use."""

    def __init__(self, board: "Board", number: int, n_cores: int) -> None:
        self.parent, self.id = board, number
        self.n2Cores = self.n2CoresAsList = [Core(self, i) for i in range(n_cores)]


class Channel:
    """A channel between two snips; `live` has its own."""

    def connect(self, source: "Snip", target: "Snip") -> None:
        """Do nothing: snips name the channels that they use."""


Snip = Mapping[str, object]


class Graph:
    """The part of a board that holds its snips and channels."""

    def __init__(self) -> None:
        self.snips: list[Snip] = []

    def createSnip(self, phase: enum.Enum, **settings: object) -> Snip:  # noqa: N802 (NxSDK's)
        """Record a snip."""
        self.snips.append({"phase": phase, **settings})
        return self.snips[-1]

    def createChannel(  # noqa: N802 (NxSDK's)
        self, name: bytes, numElements: int, messageSize: int, slack: int
    ) -> Channel:
        """Return a channel."""
        return Channel()


class Running(Protocol):
    """A board that steps; see `spikeport.backends.board.nxsdk.live`."""

    def close(self) -> None:
        """Stop the board."""


class AxonSource(Protocol):
    """An input of the host, as nengo-loihi keeps it: the axons that each of its sources reaches."""

    axon_map: dict[int, list[np.ndarray]]


@dataclass
class Executor:
    """The part of a board that says whether it has started, and where its host is."""

    started: bool = False
    _host_coordinator: SimpleNamespace = field(
        default_factory=lambda: SimpleNamespace(hostAddr="127.0.0.1")
    )

    def hasStarted(self) -> bool:  # noqa: N802 (NxSDK's)
        """Return whether the board has started."""
        return self.started


class Board(Graph):
    """A board of registers.

    Parameters
    ----------
    number : int
        Its id.
    numChips : int
        Number of chips.
    numCores : sequence of int
        Number of cores of each chip.
    numSynapses : sequence of sequence of int
        Number of synapses of each core; not used.

    Attributes
    ----------
    runs : callable, optional
        Makes a board step when it is run. None: the board only records.
    """

    runs: Callable[["Board"], Running] | None = None
    spike_inputs: Mapping[object, AxonSource]  # nengo-loihi's builder adds it

    def __init__(
        self,
        number: int,
        numChips: int,
        numCores: Sequence[int],
        numSynapses: Sequence[Sequence[int]],
    ) -> None:
        super().__init__()
        self.id = number
        self.n2Chips = [Chip(self, i, n) for i, n in enumerate(numCores)]
        self.executor = Executor()
        self._running: Running | None = None

    @property
    def cores(self) -> list[Core]:
        """The cores of all chips."""
        return [core for chip in self.n2Chips for core in chip.n2CoresAsList]

    def start(self) -> None:
        """Record that the board has started."""
        self.executor.started = True

    def run(self, steps: int, aSync: bool = False) -> None:
        """Begin to step the board, if it can step."""
        runs = type(self).runs
        if runs is not None:
            self._running = runs(self)

    def disconnect(self) -> None:
        """Stop the board, if it steps."""
        self.executor.started = False
        if self._running is not None:
            self._running.close()
