"""The chip image: inert tables and a manifest, which a chip or an emulator can be loaded from.

An image needs no Nengo to be loaded and run. It holds, for every compartment, synapse, axon, input
and output of one chip, the integers nengo-loihi's discretiser chose, and the placement on cores.
Equal networks give equal images, byte for byte, and hence equal digests.

::

    image = ChipImage.load("image.npz")
    chip = NativeChip(image, seed=0)          # from spikeport.backends.native.chip
    outputs = chip.step(np.array([0, 3]), {})  # sources 0 and 3 spike on the host
"""

import functools
import hashlib
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from spikeport.compile.image import files
from spikeport.compile.image.manifest import Header, Manifest
from spikeport.compile.image.tables import (
    LAYOUT,
    TABLES,
    Blocks,
    Compartments,
    Decoders,
    Groups,
    InAxons,
    Inputs,
    OutAxons,
    Outputs,
    Reads,
    Routes,
    Rows,
    Synapses,
    Table,
    flat,
    part,
)
from spikeport.compile.image.validation import check
from spikeport.counted import counted
from spikeport.errors import ImageError

MOST_NAMED = 3
"""Most blocks that the name of a core lists."""


@dataclass(frozen=True, eq=False)
class ChipImage:
    """A compiled network for one chip.

    `spikeport.compile.image.tables` describes the tables and each of their arrays. Two images are
    equal if their digests are equal. To change an image, make a new one:
    ``dataclasses.replace(image, blocks=...)``.
    """

    manifest: Manifest
    blocks: Blocks
    compartments: Compartments
    groups: Groups
    in_axons: InAxons
    rows: Rows
    synapses: Synapses
    routes: Routes
    out_axons: OutAxons
    inputs: Inputs
    outputs: Outputs
    reads: Reads
    decoders: Decoders

    @classmethod
    def from_arrays(cls, manifest: Manifest, arrays: Mapping[str, np.ndarray]) -> "ChipImage":
        """Return the image of arrays, by their names in `LAYOUT`.

        Raises
        ------
        ImageError
            If an array is missing, not known, or cannot be held in its type.
        """
        if set(arrays) != set(LAYOUT):
            odd = sorted(set(arrays) ^ set(LAYOUT))
            raise ImageError(
                f"image arrays do not follow schema {manifest.schema}: {', '.join(odd)}"
            )
        tables = {
            table.NAME: table(**{name: arrays[one.key] for name, one in table.columns().items()})
            for table in TABLES
        }
        return cls(manifest, **tables)  # type: ignore[arg-type]  # the tables, by their names

    @property
    def tables(self) -> Iterator[Table]:
        """Tables, in the order of the layout."""
        return (getattr(self, table.NAME) for table in TABLES)

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays, by their names in `LAYOUT`, in its order."""
        return {
            declared.key: getattr(table, name)
            for table in self.tables
            for name, declared in type(table).columns().items()
        }

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return len(self.blocks)

    @property
    def n_compartments(self) -> int:
        """Number of compartments on all cores."""
        return len(self.compartments)

    @property
    def n_sources(self) -> int:
        """Number of all sources of spikes: the compartments, and after them the inputs' sources."""
        return self.n_compartments + self.n_inputs

    @property
    def n_inputs(self) -> int:
        """Number of spiking sources on the host, of all inputs."""
        return int(self.inputs.size.sum(dtype=np.int64))

    @property
    def n_cores(self) -> int:
        """Number of cores in use."""
        return int(self.blocks.core.max(initial=-1)) + 1

    @property
    def learns(self) -> np.ndarray:
        """Mask of the groups of synapses that learn, (n_groups,)."""
        # The first column is `on`.
        result: np.ndarray = self.groups.learning[:, 0] != 0
        return result

    @property
    def sends_spikes(self) -> np.ndarray:
        """Mask of the host's sources that send spikes and encode no values, (n_inputs,)."""
        spikes = [entry.encoding.kind == "spikes" for entry in self.manifest.inputs]
        return np.repeat(np.array(spikes, dtype=bool), self.inputs.size)

    def format_of(self, group: int | np.integer) -> dict[str, int]:
        """Return the fields of nengo-loihi's SynapseConfig for a group of synapses."""
        fields = self.groups.format[group].tolist()
        return dict(zip(self.manifest.synapse_format, fields, strict=True))

    def learning_of(self, group: int | np.integer) -> dict[str, float]:
        """Return the settings by which a group of synapses learns."""
        settings = self.groups.learning[group].tolist()
        return dict(zip(self.manifest.learning, settings, strict=True))

    @property
    def error_sizes(self) -> dict[int, int]:
        """Number of errors that each group of synapses that learns takes, by the group's number.

        Two compartments decode a value, one for either sign, and share its error.
        """
        sizes = np.diff(self.blocks.start)[self.groups.block] // 2
        return {group: int(sizes[group]) for group in np.flatnonzero(self.learns).tolist()}

    @functools.cached_property
    def cores(self) -> tuple[str, ...]:
        """Names of the cores: the labels of a core's first blocks, and the number of its others."""
        names: list[list[str]] = [[] for _ in range(self.n_cores)]
        for core, block in zip(self.blocks.core, self.manifest.blocks, strict=True):
            names[core].append(block.label)
        return tuple(map(_core_name, names))

    @functools.cached_property
    def compartment_block(self) -> np.ndarray:
        """Block of each compartment, (n_compartments,)."""
        return np.repeat(np.arange(self.n_blocks), np.diff(self.blocks.start))

    @functools.cached_property
    def compartment_core(self) -> np.ndarray:
        """Core of each compartment, (n_compartments,)."""
        return np.repeat(self.blocks.core, np.diff(self.blocks.start))

    @functools.cached_property
    def compartment_place(self) -> np.ndarray:
        """Place of each compartment among those of its core, (n_compartments,)."""
        core = self.compartment_core
        order = np.argsort(core, kind="stable")
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order)) - np.searchsorted(core[order], core[order])
        return place

    @functools.cached_property
    def row_group(self) -> np.ndarray:
        """Group of synapses of each row, (n_rows,)."""
        return np.repeat(np.arange(len(self.groups)), np.diff(self.groups.row_start))

    @property
    def synapse_start(self) -> np.ndarray:
        """First synapse of each group of synapses, and their number at the end, (n_groups + 1,)."""
        result: np.ndarray = self.rows.start[self.groups.row_start]
        return result

    @functools.cached_property
    def axon_group(self) -> np.ndarray:
        """Group of synapses of each input axon, (n_axons,)."""
        return np.repeat(np.arange(len(self.groups)), np.diff(self.groups.axon_start))

    @functools.cached_property
    def axon_row(self) -> np.ndarray:
        """Row that each input axon reads, (n_axons,), numbered through all groups."""
        result: np.ndarray = self.groups.row_start[self.axon_group] + self.in_axons.row
        return result

    @functools.cached_property
    def group_core(self) -> np.ndarray:
        """Core of each group of synapses, (n_groups,)."""
        result: np.ndarray = self.blocks.core[self.groups.block]
        return result

    def read_by(self, output: int) -> np.ndarray:
        """Return the compartments that an output reads, (n,)."""
        return self.reads.compartment[part(self.outputs.start, output)]

    @property
    def readouts(self) -> np.ndarray:
        """Compartments whose voltage is decoded: they must never reach their threshold."""
        reads = [
            self.read_by(i)
            for i, output in enumerate(self.manifest.outputs)
            if output.key == "voltage" and output.weights == "matrix"
        ]
        return np.unique(flat(reads))

    @functools.cached_property
    def digest(self) -> str:
        """SHA-256 over manifest and arrays, in hexadecimal."""
        state = hashlib.sha256(self.manifest.to_json())
        for name, array in self.arrays.items():
            # Name, type and shape too: equal bytes may stand for different numbers.
            state.update(f"{name} {array.dtype.str} {array.shape}".encode())
            state.update(array.data)
        return state.hexdigest()

    def __repr__(self) -> str:
        return (
            f"<ChipImage for {self.manifest.chip}: {self.n_compartments:,} compartments on "
            f"{counted(self.n_cores, 'core')}, {self.digest[:12]}>"
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ChipImage) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def on_cores(self, core: np.ndarray) -> "ChipImage":
        """Return the image with its blocks on other cores, (n_blocks,)."""
        return replace(self, blocks=replace(self.blocks, core=core))

    @functools.cached_property
    def checked(self) -> "ChipImage":
        """The image itself, after a check that all of its numbers point at something that exists.

        Kernels follow the numbers of an image without a check, so code that runs one uses this.

        Raises
        ------
        ImageError
            Names the table, the row, the value and its bound.
        """
        check(self)
        return self

    def save(self, path: str | Path) -> None:
        """Write the image, whole or not at all."""
        files.write(Path(path), self.header, self.arrays)

    @property
    def header(self) -> bytes:
        """The header of the image's file, as JSON."""
        return Header(self.digest, self.manifest).to_json()

    def to_bytes(self) -> bytes:
        """Return the content of the image's file."""
        file = io.BytesIO()
        files.pack(file, self.header, self.arrays)
        return file.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes) -> "ChipImage":
        """Return the image in the content of a file; raises ImageError as `load` does."""
        return cls.from_header(*files.parse(content))

    @classmethod
    def load(cls, path: str | Path) -> "ChipImage":
        """Read an image.

        Raises
        ------
        ImageError
            If the file is missing, truncated, altered, of another schema, not an image at all, or
            if its numbers point outside its tables.
        """
        try:
            return cls.from_header(*files.read(Path(path)))
        except ImageError as error:
            raise ImageError(f"{path}: {error}") from None

    @classmethod
    def from_header(cls, header: Header, arrays: Mapping[str, np.ndarray]) -> "ChipImage":
        """Return the image of a header and of arrays; raises ImageError as `load` does."""
        image = cls.from_arrays(header.manifest, arrays)
        if image.digest != header.digest:
            raise ImageError(
                "the content does not match its digest: the file was altered; compile it again"
            )
        return image.checked


def _core_name(blocks: list[str]) -> str:
    more = len(blocks) - MOST_NAMED
    return " + ".join(blocks[:MOST_NAMED] + ([f"{more} more"] if more > 0 else []))
