"""The manifest of an image: names and settings of its parts, as typed values.

Programs need not parse labels: the kind of a block, and the object of the network that it comes
from, are fields of their own.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError

from spikeport.errors import ImageError
from spikeport.reading.mismatch import MismatchError, shown
from spikeport.reading.text import parse_json

SCHEMA = 2
ARITHMETIC = "nengo-loihi 1.1"
"""The name of the arithmetic of chips on an image's integers; there is only this one so far."""
SUM_BITS = 22
"""Bits of the sum of the weights that reach a compartment in a step, sign included: a larger one
wraps around. Source: nengo-loihi's emulator/interface.py, Q_BITS."""
STATE_BITS = 24
"""Bits of a current, and of a voltage, sign included. Source: nengo-loihi's discretiser."""
DELAY_BITS = 6
"""Bits of a refractory delay. Source: nengo-loihi's block.py, REFRACT_DELAY_MAX."""

Pair = tuple[int, int]
STRICT = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True)
class BlockEntry:
    """A block of compartments.

    Attributes
    ----------
    kind : str
        ``"ensemble"``: the neurons of an ensemble; ``"relay"``: decode neurons between two
        ensembles; ``"readout"``: compartments whose voltage is a decoded value.
    owner : str
        The name of the ensemble or connection that the compartments belong to.
    piece : tuple of (int, int)
        Number, from 0, and count of the pieces that the owner was built in; a piece that was itself
        cut has a second pair. Empty if the block is the whole owner.
    cut : tuple of (int, int)
        Number and count, likewise, of the pieces that an image pass cut the built block into.
    """

    kind: Literal["ensemble", "relay", "readout"]
    owner: str
    piece: tuple[Pair, ...] = ()
    cut: tuple[Pair, ...] = ()

    __pydantic_config__ = STRICT

    @property
    def label(self) -> str:
        """A name for people: the owner, and in brackets the number and count of its pieces."""
        return self.owner + _brackets([*self.piece, *self.cut])

    @property
    def built(self) -> str:
        """A name for people of the block that nengo-loihi built."""
        return self.owner + _brackets(self.piece)


def _brackets(pieces: Sequence[Pair]) -> str:
    return "".join(f"[{number + 1}/{count}]" for number, count in pieces)


@dataclass(frozen=True)
class GroupEntry:
    """A group of synapses; ``label`` is nengo-loihi's."""

    label: str

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class Filter:
    """A filter on the host: the type of Nengo's synapse, and its time constant if it has one."""

    kind: str
    tau_s: float | None

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class Encoding:
    """The host's encoding of an input's values x, one for each of d dimensions, as spikes.

    ``"on_off"`` has 2 d sources, which integrate J over time and spike, at most once a step, each
    time the integral passes 1:

        J_j = gain x_j + bias,   J_{d+j} = -gain x_j + bias       (in Hz, j = 0 .. d - 1)

    A value saturates where J passes 1 / dt: beyond -1 to 1 in nengo-loihi's encoding, whose gain
    and bias are 0.5 / dt. ``"spikes"`` sends the spikes of an ensemble on the host as
    they are, or the events of a file, of which a source may have several in a step; ``gain`` and
    ``bias`` are 0.
    """

    kind: Literal["on_off", "spikes"]
    gain: float = 0.0
    bias: float = 0.0

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class InputEntry:
    """An input: spiking sources on the host.

    Attributes
    ----------
    name : str
        Name of the connection that crosses from the host to the chip, or of the node that sends
        events of a file.
    size : int
        Number of sources.
    encoding : Encoding
        The encoding of values as spikes.
    filter : Filter, optional
        The filter on the host before the encoding; None: there is no filter.
    """

    name: str
    size: int
    encoding: Encoding
    filter: Filter | None = None

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class OutputEntry:
    """An output: compartments that are read in every step, and how the host decodes them.

    Attributes
    ----------
    name : str
        Name of the probe, or of the connection that crosses from the chip to the host.
    key : str
        The state to read: ``"voltage"``, ``"current"`` or ``"spiked"`` (0 or 1).
    weights : str
        ``"matrix"``: x -> x W with W of ``shape``; ``"scale"``: x -> w x; ``"none"``: x as it is.
    shape : tuple of int
        Shape of the decoding weights; (0,) where there are none.
    layout : str
        ``"C"`` or ``"F"``, the order of the matrix in memory, on which the rounding of a product
        depends.
    segments : tuple of int
        Number of compartments that are read of each block; products are added segment by segment.
    order : tuple of int, optional
        The decoded value that comes first, second and so on; None: the order stays.
    filter : Filter, optional
        The filter on the host behind the decoding; None: there is no filter.
    """

    name: str
    key: Literal["voltage", "current", "spiked"]
    weights: Literal["matrix", "scale", "none"]
    shape: tuple[int, ...]
    layout: Literal["C", "F"]
    segments: tuple[int, ...]
    order: tuple[int, ...] | None = None
    filter: Filter | None = None

    __pydantic_config__ = STRICT

    @property
    def size(self) -> int:
        """Number of decoded values."""
        return self.shape[1] if self.weights == "matrix" else sum(self.segments)


@dataclass(frozen=True)
class Manifest:
    """The settings of an image, and the names of its parts.

    Attributes
    ----------
    chip : str
        Name of the chip that the network was compiled for.
    dt_s : float
        The time step, in seconds.
    pes_error_scale : float
        The factor by which learning errors are multiplied before they are rounded.
    synapse_format, learning : tuple of str
        Columns of the tables ``groups.format`` and ``groups.learning``.
    weight_bits, index_bits : tuple of int
        Bits of a weight and of an index, by the code in the columns ``weight_bits`` and
        ``idx_bits`` of ``groups.format``.
    blocks, groups, inputs, outputs : tuple
        One entry for each row of the tables of these names.
    schema, arithmetic
        `SCHEMA` and `ARITHMETIC`.
    """

    chip: str
    dt_s: float
    pes_error_scale: float
    synapse_format: tuple[str, ...]
    learning: tuple[str, ...]
    weight_bits: tuple[int, ...]
    index_bits: tuple[int, ...]
    blocks: tuple[BlockEntry, ...]
    groups: tuple[GroupEntry, ...]
    inputs: tuple[InputEntry, ...]
    outputs: tuple[OutputEntry, ...]
    schema: int = SCHEMA
    arithmetic: str = ARITHMETIC

    __pydantic_config__ = STRICT

    def to_json(self) -> bytes:
        """Return the manifest as JSON: equal manifests give equal bytes."""
        return json.dumps(asdict(self), sort_keys=True, separators=(",", ":")).encode()


@dataclass(frozen=True)
class Header:
    """The member ``header`` of an image's file."""

    digest: str
    manifest: Manifest

    __pydantic_config__ = STRICT

    def to_json(self) -> bytes:
        """Return the header as JSON."""
        return b'{"digest":"%b","manifest":%b}' % (self.digest.encode(), self.manifest.to_json())


_ADAPTER = TypeAdapter(Header)


def read_header(content: bytes) -> Header:
    """Read a header from JSON.

    Raises
    ------
    ImageError
        If the header is of another schema or arithmetic, or not as `Manifest` describes it.
    """
    try:
        found = parse_json(content.decode())
    except (ValueError, RecursionError, MismatchError):
        raise ImageError("not a chip image, or truncated or altered") from None
    found = found.get("manifest") if isinstance(found, dict) else None
    _check_versions(found if isinstance(found, dict) else {})
    try:
        return _ADAPTER.validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        reason = f"{first['msg'][0].lower()}{first['msg'][1:]}"
        raise ImageError(f"{where}: {reason}; compile it again") from None


def _check_versions(found: Mapping[str, object]) -> None:
    if found.get("schema") != SCHEMA:
        raise ImageError(
            f"image schema {shown(found.get('schema'))}, this spikeport reads {SCHEMA}; compile it "
            "again"
        )
    if found.get("arithmetic") != ARITHMETIC:
        raise ImageError(
            f"an image for chip '{shown(found.get('chip'))}' that computes as "
            f"'{shown(found.get('arithmetic'))}', this spikeport as '{ARITHMETIC}'; compile the "
            "network for a chip that `spikeport chips` lists"
        )
