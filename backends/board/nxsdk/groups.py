"""Groups of synapses in a core's registers."""

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from spikeport.backends.board.nxsdk.recording import Core
from spikeport.backends.board.nxsdk.registers import Register
from spikeport.errors import BackendError

BASE_UNITS = {
    "discreteMapEntry": (0, 1),
    "population16MapEntry": (16, 4),
    "population32MapEntry": (32, 1),
}
"""Kind of an axon, and compartments in one unit of its base, by the name of the axon's entry."""

RowPlace = tuple[int, int, int]
"""Pointer, targets and atoms of a row in a core's synapse memory."""


class InAxon(NamedTuple):
    """An input axon of a core: its number, its row, and the compartment that targets count from."""

    number: int
    row: RowPlace
    base: int


class Group(NamedTuple):
    """Synapses of one format and one kind of axon on a core, and the axons that read them."""

    core: int
    form: int
    kind: int
    axons: list[InAxon]

    @property
    def rows(self) -> dict[RowPlace, int]:
        """Numbers of the group's rows, in the order in which axons read them first."""
        places = dict.fromkeys(axon.row for axon in self.axons)
        return {place: number for number, place in enumerate(places)}


def groups_of(number: int, core: Core) -> list[Group]:
    """Return the groups of a core.

    Parameters
    ----------
    number : int
        The core's number.
    core : Core
        Its registers.

    Raises
    ------
    BackendError
        If a row has synapses of several formats.
    """
    formats = core.synapses.column("synFmtId")
    found: dict[tuple[int, int], list[InAxon]] = defaultdict(list)
    for axon, entry in sorted(core.bank("synapseMap").items()):
        if "synapsePtr" in vars(entry):  # a learning axon's second entry has none
            kind, made = _axon(axon, entry)
            begin, length, atoms = made.row
            forms = np.unique(formats[begin : begin + length * atoms])
            if len(forms) != 1:
                raise BackendError(f"axon {axon} of core {number} has synapses of formats {forms}")
            found[int(forms[0]), kind].append(made)
    return [Group(number, form, kind, axons) for (form, kind), axons in sorted(found.items())]


def _axon(number: int, entry: Register) -> tuple[int, InAxon]:
    """Return the kind of an axon, and the axon."""
    name = next(name for name in BASE_UNITS if name in vars(entry))
    kind, unit = BASE_UNITS[name]
    base = unit * value(getattr(entry, name), "cxBase")
    atoms = value(entry, "popSize") if kind else 1
    row = value(entry, "synapsePtr"), value(entry, "synapseLen"), atoms
    return kind, InAxon(number, row, base)


def value(register: Register, field: str) -> int:
    """Return a field of a register.

    Raises
    ------
    BackendError
        If the field was not written.
    """
    found = getattr(register, field)
    if isinstance(found, Register):
        raise BackendError(f"register field {field} was not written")
    return int(found)


def values(registers: Sequence[Register], field: str) -> np.ndarray:
    """Return a field of several registers, (n,)."""
    return np.array([value(register, field) for register in registers], dtype=np.int64)
