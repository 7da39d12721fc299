"""The tables of an image: frozen arrays, with one declaration for the content of each.

The declarations below are the layout. The names of arrays in a file, their types, the order in
which a digest takes them, and the checks of `spikeport.compile.image.validation` all follow from
them.

A column called ``start`` (or ``..._start``) divides another table: the part that belongs to row
``i`` is ``[start[i] : start[i + 1]]``, so it has one entry more than its table has rows.
"""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, NamedTuple, TypedDict

import numpy as np

from spikeport.errors import ImageError

NONE = -1
"""A number that points at nothing."""


class Column(NamedTuple):
    """An array of an image.

    Attributes
    ----------
    key : str
        Its name in a file.
    dtype : str
        Its type.
    meaning : str
        Its content.
    divides : str
        The table it divides, if it is a start.
    into : str
        The table whose rows its numbers point to.
    low, high : int, optional
        The smallest and the largest number that is allowed.
    width : str
        The list in the manifest that names its columns, if it has more than one.
    """

    key: str
    dtype: str
    meaning: str
    divides: str = ""
    into: str = ""
    low: int | None = None
    high: int | None = None
    width: str = ""


def column(key: str, dtype: str, meaning: str, **more: Any) -> Any:
    """Declare an array of a table; see `Column`."""
    return field(metadata={"column": Column(key, dtype, meaning, **more)})


@dataclass(frozen=True, eq=False)
class Table:
    """Arrays with an entry for each row, read-only and in the types of the layout.

    Raises
    ------
    ImageError
        If an array cannot be held in its type.
    """

    NAME: ClassVar[str]

    def __post_init__(self) -> None:
        """Freeze the arrays in their types."""
        for name, declared in type(self).columns().items():
            array = _canonical(getattr(self, name), declared, f"{self.NAME}.{name}")
            object.__setattr__(self, name, array)

    @classmethod
    def columns(cls) -> dict[str, Column]:
        """Return the columns, by the name of their attribute."""
        return {one.name: one.metadata["column"] for one in fields(cls)}

    def __len__(self) -> int:
        """Return the number of rows."""
        name, declared = next(iter(type(self).columns().items()))
        return max(len(getattr(self, name)) - bool(declared.divides), 0)


@dataclass(frozen=True, eq=False)
class Blocks(Table):
    """Groups of compartments that share a core and its settings."""

    NAME = "blocks"
    start: np.ndarray = column(
        "block_start", "<i8", "compartments of each block", divides="compartments"
    )
    core: np.ndarray = column("block_core", "<i4", "core each block is placed on", low=0)
    vmin: np.ndarray = column("block_vmin", "<i4", "lower clip of the voltage")
    vmax: np.ndarray = column("block_vmax", "<i4", "upper clip of the voltage")
    noise_offset: np.ndarray = column("block_noise_offset", "<i4", "mantissa offset of the noise")
    noise_exp: np.ndarray = column(
        "block_noise_exp", "<i4", "exponent of the noise", low=0, high=31
    )
    noise_at_membrane: np.ndarray = column(
        "block_noise_at_membrane",
        "<i4",
        "1: noise on the voltage, 0: on the current",
        low=0,
        high=1,
    )


@dataclass(frozen=True, eq=False)
class Compartments(Table):
    """Constants of compartments; see `spikeport.backends.native.kernel` for the equations."""

    NAME = "compartments"
    bias: np.ndarray = column("bias", "<i4", "bias current")
    decay_u: np.ndarray = column(
        "decay_u", "<i4", "a step keeps (4095 - decay_u) / 4096 of u", low=0, high=4095
    )
    decay_v: np.ndarray = column(
        "decay_v", "<i4", "a step keeps (4096 - decay_v) / 4096 of v", low=0, high=4096
    )
    vth: np.ndarray = column("vth", "<i4", "threshold")
    refract_delay: np.ndarray = column("refract_delay", "<i4", "refractory delay, in steps", low=0)
    enable_noise: np.ndarray = column("enable_noise", "|u1", "1: noise is on", low=0, high=1)


@dataclass(frozen=True, eq=False)
class Groups(Table):
    """Groups of synapses of one block that are stored alike: rows of weights, and their axons."""

    NAME = "groups"
    block: np.ndarray = column(
        "synapse_block", "<i4", "block each synapse group belongs to", into="blocks"
    )
    pop_type: np.ndarray = column(
        "synapse_pop_type",
        "<i4",
        "0: discrete axons, 16 or 32: population axons",
        low=0,
        high=32,
    )
    format: np.ndarray = column(
        "synapse_format",
        "<i4",
        "how rows are stored; columns in manifest.synapse_format",
        width="synapse_format",
    )
    learning: np.ndarray = column(
        "synapse_learning",
        "<f8",
        "how weights learn; columns in manifest.learning",
        width="learning",
    )
    axon_start: np.ndarray = column(
        "in_axon_start", "<i8", "input axons of each synapse group", divides="in_axons"
    )
    row_start: np.ndarray = column(
        "row_start", "<i8", "weight rows of each synapse group", divides="rows"
    )


@dataclass(frozen=True, eq=False)
class InAxons(Table):
    """Input axons: a spike on one adds a row of weights."""

    NAME = "in_axons"
    row: np.ndarray = column(
        "in_axon_row", "<i4", "weight row each input axon reads, within its group", low=0
    )
    base: np.ndarray = column(
        "in_axon_base",
        "<i4",
        "compartment of the block that the row's indices count from, -1: axon not used",
        low=NONE,
    )


@dataclass(frozen=True, eq=False)
class Rows(Table):
    """Rows of weights, each with the same number of weights for each of its atoms."""

    NAME = "rows"
    atoms: np.ndarray = column(
        "row_atoms", "<i4", "number of atoms (alternative weights) of each row", low=1
    )
    start: np.ndarray = column(
        "row_weight_start", "<i8", "weights of each row, atom after atom", divides="synapses"
    )


@dataclass(frozen=True, eq=False)
class Synapses(Table):
    """Weights and their targets."""

    NAME = "synapses"
    weight: np.ndarray = column("weights", "<i4", "synaptic weights, exponent applied")
    index: np.ndarray = column(
        "indices", "<i2", "target compartment of each weight, from the axon's base", low=0
    )


@dataclass(frozen=True, eq=False)
class Routes(Table):
    """Routes: the output axons of a block, or of an input, to one group of synapses."""

    NAME = "routes"
    from_input: np.ndarray = column(
        "route_input", "|u1", "1: the source is an input, 0: a block", low=0, high=1
    )
    source: np.ndarray = column("route_source", "<i4", "number of the source block or input", low=0)
    group: np.ndarray = column(
        "route_synapse", "<i4", "synapse group the route leads to", into="groups"
    )
    start: np.ndarray = column(
        "route_start", "<i8", "source compartments of each route", divides="out_axons"
    )


@dataclass(frozen=True, eq=False)
class OutAxons(Table):
    """Output axons: for each source of a route, the input axon that its spikes reach."""

    NAME = "out_axons"
    axon: np.ndarray = column(
        "route_axon",
        "<i4",
        "input axon each source compartment reaches, within the group, -1: none",
        low=NONE,
    )
    atom: np.ndarray = column("route_atom", "<i4", "atom each source compartment selects", low=0)


@dataclass(frozen=True, eq=False)
class Inputs(Table):
    """Spiking sources on the host."""

    NAME = "inputs"
    size: np.ndarray = column("input_size", "<i4", "number of spiking sources of each input", low=0)


@dataclass(frozen=True, eq=False)
class Outputs(Table):
    """Values that the host decodes from the state of compartments."""

    NAME = "outputs"
    start: np.ndarray = column(
        "output_start", "<i8", "compartments each output reads, in order", divides="reads"
    )
    weight_start: np.ndarray = column(
        "output_weight_start", "<i8", "weights of each output, row-major", divides="decoders"
    )


@dataclass(frozen=True, eq=False)
class Reads(Table):
    """Compartments that outputs read."""

    NAME = "reads"
    compartment: np.ndarray = column(
        "output_compartment", "<i8", "the compartments", into="compartments"
    )


@dataclass(frozen=True, eq=False)
class Decoders(Table):
    """Decoding weights of outputs."""

    NAME = "decoders"
    weight: np.ndarray = column(
        "output_weights", "<f8", "decoding weights, of the shape in the manifest's outputs"
    )


BLOCK_SETTINGS = tuple(name for name in Blocks.columns() if name not in ("start", "core"))
"""Columns of ``blocks`` that are settings of a core: the clips of voltages, and noise."""

TABLES: tuple[type[Table], ...] = (
    Blocks,
    Compartments,
    Groups,
    InAxons,
    Rows,
    Synapses,
    Routes,
    OutAxons,
    Inputs,
    Outputs,
    Reads,
    Decoders,
)
LAYOUT: dict[str, Column] = {
    declared.key: declared for table in TABLES for declared in table.columns().values()
}
"""Arrays of an image, by their name in a file."""


class RowTables(TypedDict):
    """The tables of rows and of their synapses, which are made together."""

    rows: Rows
    synapses: Synapses


def part(start: np.ndarray, i: int | np.integer) -> slice:
    """Return the place of part ``i`` in the array that ``start`` divides."""
    return slice(int(start[i]), int(start[i + 1]))


def parts(start: np.ndarray, array: np.ndarray) -> list[np.ndarray]:
    """Return all parts of an array that ``start`` divides; `np.split` takes ten times as long."""
    return [array[a:b] for a, b in itertools.pairwise(start.tolist())]


def offsets(sizes: Iterable[int] | np.ndarray) -> np.ndarray:
    """Return the beginnings of parts laid end to end, and the end of the last one."""
    # `cumsum` takes no generator.
    sizes = sizes if isinstance(sizes, np.ndarray) else list(sizes)
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def flat(arrays: Sequence[np.ndarray], dtype: type = int) -> np.ndarray:
    """Return the arrays laid end to end."""
    return np.concatenate(arrays) if len(arrays) else np.zeros(0, dtype)


def positions(numbers: np.ndarray, n: int) -> list[np.ndarray]:
    """Return the positions of each of the numbers 0 to n - 1 in an array, ascending."""
    start = offsets(np.bincount(numbers, minlength=n))[: n + 1]
    return parts(start, np.argsort(numbers, kind="stable"))


def ranges(begin: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the ranges with these beginnings and sizes, laid end to end."""
    result: np.ndarray = np.arange(sizes.sum()) + np.repeat(begin - offsets(sizes)[:-1], sizes)
    return result


def _canonical(array: np.ndarray, declared: Column, name: str) -> np.ndarray:
    array, dtype, ndim = np.asarray(array), declared.dtype, 1 + bool(declared.width)
    if array.ndim != ndim:
        raise ImageError(f"{name} is an array of {array.ndim} dimensions, not {ndim}")
    if array.dtype.str == dtype and array.flags.c_contiguous and not array.flags.writeable:
        return array  # frozen before: tables that a pass leaves alone are shared
    if array.dtype.kind not in "biuf":
        raise ImageError(f"{name}: values of type {array.dtype} are no numbers")
    with np.errstate(invalid="ignore"):
        canonical = np.array(array, dtype=dtype, order="C")
    # NumPy would cut or wrap in silence.
    if array.dtype != canonical.dtype and not np.array_equal(canonical, array):
        raise ImageError(f"{name}: values of {array.dtype} do not fit into {dtype}")
    canonical.setflags(write=False)
    return canonical
