"""Registers that remember what is written to them.

Names are NxSDK's, as nengo-loihi's hardware builder uses them; any name is accepted.
"""

from array import array

import numpy as np

from spikeport.errors import BackendError

SYNAPSE_FIELDS = ("CIdx", "Wgt", "synFmtId", "LrnEn")


class Register:
    """A register with named fields, and registers within it.

    A field is written by `configure`, or as an attribute, and read back as an attribute. A name
    that was never written is a register within this one, empty until a field of it is written.
    """

    def configure(self, **values: object) -> None:
        """Write fields."""
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> "Register":
        if name.startswith("_"):
            raise AttributeError(name)  # so that copies and pickles find no fields of these names
        within = self.__dict__[name] = Register()
        return within


class Bank(dict[int, Register]):
    """Registers by number, as many as a core has; a register is made when it is first used."""

    def __init__(self, name: str, size: int) -> None:
        super().__init__()
        self._name, self._size = name, size

    def __missing__(self, number: int) -> Register:
        if not 0 <= number < self._size:
            raise BackendError(f"register {self._name}[{number}]; a core has {self._size}")
        register = self[int(number)] = Register()
        return register


class SynapseMemory:
    """The synapses of a core, which are written one after the other.

    Most registers are synapses, so they are kept as numbers. ``memory[i].configure(...)`` writes
    synapse i.
    """

    def __init__(self) -> None:
        self._columns = [array("l") for _ in SYNAPSE_FIELDS]

    def __len__(self) -> int:
        """Return the number of synapses written."""
        return len(self._columns[0])

    def __getitem__(self, number: int) -> "SynapseMemory":
        if number != len(self):
            raise BackendError(f"synapse {number} of a core is written after {len(self)} others")
        return self

    def configure(self, **values: int) -> None:
        """Write the next synapse; ``values`` are the fields of `SYNAPSE_FIELDS`."""
        for column, name in zip(self._columns, SYNAPSE_FIELDS, strict=True):
            column.append(values[name])

    def column(self, name: str) -> np.ndarray:
        """Return a field of all synapses, (n,)."""
        return np.array(self._columns[SYNAPSE_FIELDS.index(name)], dtype=np.int64)
