"""The chip image: inert arrays and a manifest, which a chip or an emulator can be loaded from.

An image needs no Nengo to be loaded and run. It holds, for every compartment, synapse, axon, input
and output of one chip, the integers nengo-loihi's discretiser chose, and the placement on cores.
Equal networks give equal images, byte for byte, and hence equal digests.

The arrays are listed in `LAYOUT`. An array ``x_start`` holds offsets: part ``i`` of the array it
divides is ``[x_start[i]:x_start[i + 1]]``.
"""

import functools
import hashlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spikeport.atomic import atomic_path
from spikeport.errors import ImageError

SCHEMA = 1
ARITHMETIC = "nengo-loihi 1.1"
"""How chips and emulators compute from the integers of an image; the only way there is so far."""

LAYOUT: dict[str, tuple[str, str]] = {
    # blocks: groups of compartments that share a core and its settings
    "block_start": ("<i8", "compartments of each block"),
    "block_core": ("<i4", "core each block is placed on"),
    "block_vmin": ("<i4", "lower clip of the voltage"),
    "block_vmax": ("<i4", "upper clip of the voltage"),
    "block_noise_offset": ("<i4", "mantissa offset of the noise"),
    "block_noise_exp": ("<i4", "exponent of the noise"),
    "block_noise_at_membrane": ("<i4", "1: noise on the voltage, 0: on the current"),
    # compartments
    "bias": ("<i4", "bias current"),
    "decay_u": ("<i4", "decay of the current, in 1/4096"),
    "decay_v": ("<i4", "decay of the voltage, in 1/4096"),
    "vth": ("<i4", "threshold"),
    "refract_delay": ("<i4", "refractory delay, in steps"),
    "enable_noise": ("|u1", "1: noise is on"),
    # synapses: groups of input axons of one block
    "synapse_block": ("<i4", "block each synapse group belongs to"),
    "synapse_pop_type": ("<i4", "0: discrete axons, 16 or 32: population axons"),
    "synapse_format": ("<i4", "one row per group, columns in manifest['synapse_format']"),
    "synapse_learning": ("<f8", "one row per group, columns in manifest['learning']"),
    "in_axon_start": ("<i8", "input axons of each synapse group"),
    "in_axon_row": ("<i4", "weight row each input axon reads, within its group"),
    "in_axon_base": ("<i4", "compartment the row's indices count from, -1: axon not used"),
    "row_start": ("<i8", "weight rows of each synapse group"),
    "row_atoms": ("<i4", "number of atoms (alternative weights) of each row"),
    "row_weight_start": ("<i8", "weights of each row, atom after atom"),
    "weights": ("<i4", "synaptic weights, exponent applied"),
    "indices": ("<i2", "target compartment of each weight, from the axon's base"),
    # routes: output axons, from a block or an input to one synapse group
    "route_input": ("|u1", "1: the source is an input, 0: a block"),
    "route_source": ("<i4", "number of the source block or input"),
    "route_synapse": ("<i4", "synapse group the route leads to"),
    "route_start": ("<i8", "source compartments of each route"),
    "route_axon": ("<i4", "input axon each source compartment reaches, -1: none"),
    "route_atom": ("<i4", "atom each source compartment selects"),
    # inputs and outputs
    "input_size": ("<i4", "number of spiking sources of each input"),
    "output_start": ("<i8", "compartments each output reads, in order"),
    "output_compartment": ("<i8", "the compartments"),
    "output_weight_start": ("<i8", "weights of each output, row-major"),
    "output_weights": ("<f8", "decoding weights, of shape manifest['outputs'][i]['shape']"),
}


@dataclass(frozen=True, eq=False)
class ChipImage:
    """A compiled network for one chip.

    ``manifest`` is JSON-ready: schema, arithmetic, chip, ``dt_s``, labels of blocks, synapses,
    inputs and outputs, and the columns of the tables. ``arrays`` has exactly the keys of `LAYOUT`,
    in the dtypes given there. Two images are equal when their digests are.
    """

    manifest: Mapping[str, Any]
    arrays: Mapping[str, np.ndarray]

    def __post_init__(self) -> None:
        """Freeze the arrays in their canonical dtypes."""
        if set(self.arrays) != set(LAYOUT):
            odd = sorted(set(self.arrays) ^ set(LAYOUT))
            raise ImageError(f"image arrays do not follow schema {SCHEMA}: {', '.join(odd)}")
        frozen = {name: _canonical(self.arrays[name], dtype) for name, (dtype, _) in LAYOUT.items()}
        object.__setattr__(self, "arrays", frozen)

    def __getitem__(self, name: str) -> np.ndarray:
        """One of the arrays of `LAYOUT`."""
        return self.arrays[name]

    def part(self, name: str, i: int | np.integer) -> slice:
        """Where part ``i`` lies in the array that ``name``, a ``_start`` array, divides."""
        start = self.arrays[name]
        return slice(int(start[i]), int(start[i + 1]))

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return len(self["block_core"])

    @property
    def n_compartments(self) -> int:
        """Number of compartments on all cores."""
        return len(self["bias"])

    @property
    def n_cores(self) -> int:
        """Number of cores in use."""
        return int(self["block_core"].max()) + 1

    @property
    def cores(self) -> tuple[str, ...]:
        """A label for each core: those of its first blocks, and how many more it has."""
        labels: list[list[str]] = [[] for _ in range(self.n_cores)]
        for core, block in zip(self["block_core"], self.manifest["blocks"], strict=True):
            labels[core].append(block["label"])
        return tuple(_core_label(names) for names in labels)

    @functools.cached_property
    def compartment_core(self) -> np.ndarray:
        """(n_compartments,) core of each compartment."""
        return np.repeat(self["block_core"], np.diff(self["block_start"]))

    @functools.cached_property
    def digest(self) -> str:
        """SHA-256 over manifest and arrays, in hexadecimal."""
        state = hashlib.sha256(_manifest_bytes(self.manifest))
        for name in LAYOUT:
            array = self.arrays[name]
            state.update(f"{name} {array.dtype.str} {array.shape}".encode())
            state.update(array.tobytes())
        return state.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ChipImage) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def save(self, path: str | Path) -> None:
        """Write the image, whole or not at all."""
        header = {"digest": self.digest, "manifest": self.manifest}
        content = np.frombuffer(_manifest_bytes(header), np.uint8)
        members: dict[str, Any] = {"header": content, **self.arrays}
        with atomic_path(Path(path)) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, **members)

    @classmethod
    def load(cls, path: str | Path) -> "ChipImage":
        """Read an image.

        Raises
        ------
        ImageError
            If the file is missing, truncated, altered, of another schema or not an image at all.
        """
        try:
            content = io.BytesIO(Path(path).read_bytes())
        except FileNotFoundError:
            raise ImageError(f"{path}: no such file") from None
        except OSError as error:
            raise ImageError(f"{path}: {error.strerror}") from None
        try:
            with np.load(content, allow_pickle=False) as file:
                header = json.loads(bytes(file["header"]))
                arrays = {name: file[name] for name in file.files if name != "header"}
        except Exception:  # whatever numpy, zipfile, zlib and json make of foreign bytes
            raise ImageError(f"{path}: not a chip image, or truncated or altered") from None
        return cls._checked(header, arrays, path)

    @classmethod
    def _checked(cls, header: Any, arrays: dict[str, np.ndarray], path: str | Path) -> "ChipImage":
        manifest = header.get("manifest") if isinstance(header, dict) else None
        manifest = manifest if isinstance(manifest, dict) else {}
        if manifest.get("schema") != SCHEMA:
            raise ImageError(
                f"{path}: image schema {manifest.get('schema')}, this spikeport reads {SCHEMA}; "
                "compile it again"
            )
        if manifest.get("arithmetic") != ARITHMETIC:
            raise ImageError(
                f"{path}: an image for chip '{manifest.get('chip')}' that computes as "
                f"'{manifest.get('arithmetic')}', this spikeport as '{ARITHMETIC}'; compile the "
                "network for a chip that `spikeport chips` lists"
            )
        try:
            image = cls(manifest, arrays)
        except ImageError as error:
            raise ImageError(f"{path}: {error}") from None
        if image.digest != header.get("digest"):
            raise ImageError(
                f"{path}: the content does not match its digest: the file was altered; "
                "compile it again"
            )
        return image


def _core_label(blocks: list[str], most: int = 3) -> str:
    more = len(blocks) - most
    return " + ".join(blocks[:most] + ([f"{more} more"] if more > 0 else []))


def _canonical(array: np.ndarray, dtype: str) -> np.ndarray:
    array = np.ascontiguousarray(array)
    canonical = array.astype(dtype)
    if array.size and not np.array_equal(canonical, array):
        raise ImageError(f"values of {array.dtype} do not fit into {dtype}")
    canonical.setflags(write=False)
    return canonical


def _manifest_bytes(manifest: Mapping[str, Any]) -> bytes:
    return json.dumps(manifest, sort_keys=True, separators=(",", ":")).encode()
