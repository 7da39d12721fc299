"""Checks that every number of an image points at something that exists.

Kernels follow the numbers of an image without a check. A file with a digest that fits may have been
made by hand, so everything that a kernel relies on is checked first: the length of every array, the
order of every start, the bounds of every number, and, across tables, that axons, rows and targets
lie within the group or block they belong to. The image may still compute nonsense.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from spikeport.compile.image.deliveries import row_lengths
from spikeport.compile.image.tables import Column, Table, part
from spikeport.errors import ImageError

if TYPE_CHECKING:
    from spikeport.compile.image.chip_image import ChipImage

MOST_ATOMS = 512
"""The most atoms of a row: nengo-loihi has 9 bits for them."""
MOST_INPUTS = 1 << 20
"""The most sources on the host: each costs memory, but a file may state any number of them."""
FORMAT = (
    *("weight_limit_mant", "weight_limit_exp", "weight_exp", "disc_max_weight", "learning_cfg"),
    *("tag_bits", "delay_bits", "weight_bits", "reuse_synapse_data", "n_synapses", "idx_offset"),
    *("idx_mult", "skip_bits", "idx_bits", "synapse_type", "fanout_type", "compression"),
    *("stdp_cfg", "ignore_delay"),
)
"""Columns of ``groups.format``: the fields of nengo-loihi's SynapseConfig."""
COUNTED = ("weight_bits", "idx_bits", "compression", "n_synapses", "delay_bits", "tag_bits")
"""Columns of ``groups.format`` by which memory is counted."""
WEIGHT_BITS_OF_CODE, INDEX_BITS_OF_CODE = (0, 1, 2, 3, 4, 5, 6, 8), (0, 6, 7, 8, 9, 10, 11, 12)
"""Bits of a weight and of an index by their codes. Source: nengo-loihi's SynapseConfig."""
LEARNING = ("on", "lr_int", "lr_exp", "tracing_tau", "tracing_mag", "train_epoch", "learn_epoch")
"""Columns of ``groups.learning``."""
MOST_LEARNING = 2**30
"""The largest size of a number in ``groups.learning``, by which NumPy multiplies and shifts 32
bits."""
MOST_SHIFT = 63
"""The largest size of a learning group's ``weight_exp``, by which NumPy shifts."""


def check(image: "ChipImage") -> None:
    """Check that every number of an image points at something that exists.

    Raises
    ------
    ImageError
        At the first number out of bounds; the message names table, row, value and bound.
    """
    for table in image.tables:
        _check_lengths(image, table)
    for table in image.tables:
        for name, column in table.columns().items():
            _check_values(image, table, name, column)
    # In this order: later checks follow numbers that earlier ones have bounded.
    _check_manifest(image)
    _check_blocks(image)
    _check_cores(image)
    _check_rows(image)
    _check_axons(image)
    _check_routes(image)
    _check_inputs(image)
    _check_outputs(image)
    _check_formats(image)
    _check_learning(image)


def _error(place: str, value: object, bound: str) -> ImageError:
    return ImageError(f"{place} is {value}, {bound}; compile it again")


def _require(
    holds: np.ndarray, place: str, values: np.ndarray, bound: str, limits: np.ndarray | None = None
) -> None:
    """Refuse the first row where a condition does not hold, with the bound of that row."""
    if not holds.all():
        row = int(holds.argmin())
        if limits is not None:
            bound = f"{bound} {limits[row]}"
        raise _error(f"{place}[{row}]", values[row], bound)


def _check_lengths(image: "ChipImage", table: Table) -> None:
    for name, column in table.columns().items():
        wanted: tuple[int, ...] = (len(table) + bool(column.divides),)
        if column.width:
            wanted += (len(getattr(image.manifest, column.width)),)
        shape = getattr(table, name).shape
        if shape != wanted:
            raise _error(f"the shape of {table.NAME}.{name}", shape, f"not {wanted}")


def _check_values(image: "ChipImage", table: Table, name: str, column: Column) -> None:
    values, place = getattr(table, name), f"{table.NAME}.{name}"
    low, high = column.low, column.high
    if column.divides:
        _check_start(values, place, column.divides, len(getattr(image, column.divides)))
    if column.into:
        low, high = 0, len(getattr(image, column.into)) - 1
    if low is not None and values.min(initial=low) < low:
        _require(values >= low, place, values, f"at least {low}")
    if high is not None and values.max(initial=high) > high:
        of = f", the last of {column.into}" if column.into else ""
        _require(values <= high, place, values, f"at most {high}{of}")


def _check_start(start: np.ndarray, place: str, divided: str, length: int) -> None:
    if start.size == 0 or start[0] != 0:
        raise _error(f"{place}[0]", start[0] if start.size else "missing", "not 0")
    # Each start is at least the one before, so that no part has a negative length.
    before = np.append(0, start[:-1])
    _require(start >= before, place, start, "at least", before)
    if start[-1] != length:
        raise _error(f"{place}[{len(start) - 1}]", start[-1], f"not {length}, all of {divided}")


def _check_manifest(image: "ChipImage") -> None:
    manifest = image.manifest
    for name in ("blocks", "groups", "inputs", "outputs"):
        entries, rows = len(getattr(manifest, name)), len(getattr(image, name))
        if entries != rows:
            raise _error(f"the number of manifest.{name}", entries, f"not {rows}, as in the table")
    if not (math.isfinite(manifest.dt_s) and manifest.dt_s > 0):
        raise _error("manifest.dt_s", manifest.dt_s, "not a positive number")
    if not math.isfinite(manifest.pes_error_scale):
        raise _error("manifest.pes_error_scale", manifest.pes_error_scale, "not a finite number")
    for name, wanted in (
        ("learning", LEARNING),
        ("synapse_format", FORMAT),
        ("weight_bits", WEIGHT_BITS_OF_CODE),
        ("index_bits", INDEX_BITS_OF_CODE),
    ):
        if (found := getattr(manifest, name)) != wanted:
            raise _error(f"manifest.{name}", found, f"not {wanted}")


def _check_blocks(image: "ChipImage") -> None:
    """Refuse images without a block, and blocks without a compartment: no compile makes them."""
    if image.n_blocks == 0:
        raise _error("the number of blocks", 0, "at least 1")
    sizes = np.diff(image.blocks.start)
    _require(sizes >= 1, "the size of blocks", sizes, "at least 1")


def _check_cores(image: "ChipImage") -> None:
    """Refuse more cores than blocks, and numbers of cores that do not run from 0 without a gap."""
    core, n = image.blocks.core, image.n_blocks
    _require(core < n, "blocks.core", core, f"at most {n - 1}, one for each block")
    # No longer than the number of blocks, by the check above, whatever the file says.
    used = np.zeros(int(core.max(initial=-1)) + 1, dtype=bool)
    used[core] = True
    if not used.all():
        raise _error("the first core without a block", int(used.argmin()), f"of {len(used)} cores")


def _check_rows(image: "ChipImage") -> None:
    atoms, sizes = image.rows.atoms, np.diff(image.rows.start)
    _require(atoms <= MOST_ATOMS, "rows.atoms", atoms, f"at most {MOST_ATOMS}")
    _require(
        sizes % atoms == 0, "rows.atoms", atoms, "no divisor of the row's number of weights,", sizes
    )


def _check_axons(image: "ChipImage") -> None:
    """Refuse axons that read rows of other groups, or with targets outside the group's block."""
    groups, axons = image.groups, image.in_axons
    n_axons, n_rows = np.diff(groups.axon_start), np.diff(groups.row_start)
    last = np.repeat(n_rows, n_axons) - 1
    _require(axons.row <= last, "in_axons.row", axons.row, "at most", last)
    row = np.repeat(groups.row_start[:-1], n_axons) + axons.row
    farthest = axons.base + _largest_indices(image)[row]
    end = np.repeat(np.diff(image.blocks.start)[groups.block], n_axons)
    # An axon without a base delivers nothing, so its row may point anywhere.
    inside = (axons.base < 0) | (farthest < end)
    _require(inside, "the farthest target of in_axons", farthest, "at most", end - 1)


def _largest_indices(image: "ChipImage") -> np.ndarray:
    """Return the largest index in each row, -1 where it is empty, (n_rows,)."""
    start = image.rows.start
    filled = np.diff(start) > 0
    largest = np.full(len(filled), -1, dtype=np.int64)
    if filled.any():
        # For an empty part `reduceat` would return the first index behind it.
        largest[filled] = np.maximum.reduceat(image.synapses.index, start[:-1][filled])
    return largest


def _check_routes(image: "ChipImage") -> None:
    """Refuse routes without an axon for each source, or with axons or atoms of another group."""
    routes, axon, atom = image.routes, image.out_axons.axon, image.out_axons.atom
    of_input = routes.from_input == 1
    last = np.where(of_input, len(image.inputs), image.n_blocks) - 1
    _require(routes.source <= last, "routes.source", routes.source, "at most", last)
    sizes = np.concatenate([np.diff(image.blocks.start), image.inputs.size])
    wanted = sizes[np.where(of_input, image.n_blocks, 0) + routes.source]
    found = np.diff(routes.start)
    _require(found == wanted, "the length of routes", found, "not that of its source,", wanted)
    group = np.repeat(routes.group, found)
    last = np.diff(image.groups.axon_start)[group] - 1
    _require(axon <= last, "out_axons.axon", axon, "at most", last)
    used = np.flatnonzero(axon >= 0)
    reached = image.groups.axon_start[group[used]] + axon[used]
    row = image.groups.row_start[group[used]] + image.in_axons.row[reached]
    last = atom.copy()  # without an axon, any atom is accepted
    last[used] = image.rows.atoms[row] - 1
    _require(atom <= last, "out_axons.atom", atom, "at most", last)


def _check_inputs(image: "ChipImage") -> None:
    size = image.inputs.size
    # Python's integers, since those of JSON may have any length.
    stated = np.array([entry.size for entry in image.manifest.inputs], dtype=object)
    _require(size == stated, "manifest.inputs.size", stated, "not", size)
    if image.n_inputs > MOST_INPUTS:
        raise _error("the sum of inputs.size", image.n_inputs, f"at most {MOST_INPUTS}")


def _check_outputs(image: "ChipImage") -> None:
    reads, weights = np.diff(image.outputs.start), np.diff(image.outputs.weight_start)
    for i, entry in enumerate(image.manifest.outputs):
        place = f"manifest.outputs[{i}]"
        shapes = {"matrix": entry.shape[1:] and (int(reads[i]), entry.shape[1]), "scale": (1,)}
        shape = shapes.get(entry.weights, (0,))
        if entry.shape != shape or math.prod(shape) != weights[i]:
            raise _error(f"{place}.shape", entry.shape, f"of {weights[i]} weights, not {shape}")
        # Without a segment there would be no sum to decode, and no block to read.
        if min(entry.segments, default=0) < 1 or sum(entry.segments) != reads[i]:
            bound = f"not {reads[i]} in sum, of one or more that are at least 1"
            raise _error(f"{place}.segments", entry.segments, bound)
        if entry.order is not None and sorted(entry.order) != list(range(entry.size)):
            raise _error(f"{place}.order", entry.order, f"no order of {entry.size} values")
        if entry.order is not None and entry.weights == "matrix":
            raise _error(f"{place}.order", entry.order, "of values of a matrix, which has its own")


def _check_formats(image: "ChipImage") -> None:
    form = image.groups.format
    bits = {"weight_bits": len(WEIGHT_BITS_OF_CODE), "idx_bits": len(INDEX_BITS_OF_CODE)}
    for name in COUNTED:
        values = form[:, FORMAT.index(name)]
        # nengo-loihi says -1 where no index is long enough: such a block is cut before it is run.
        low = -1 if name == "idx_bits" else 0
        high = bits.get(name, 64) - 1
        inside = (values >= low) & (values <= high)
        _require(inside, f"groups.format {name}", values, f"not from {low} to {high}")


def _check_learning(image: "ChipImage") -> None:
    learning = image.groups.learning[image.learns]
    sizes = np.abs(learning).max(axis=1, initial=0)
    _require(
        sizes <= MOST_LEARNING,
        "the largest number of groups.learning",
        sizes,
        f"not finite and at most {MOST_LEARNING}",
    )
    n_rows = np.diff(image.groups.row_start)[image.learns]
    _require(n_rows >= 1, "the learning groups' number of rows", n_rows, "at least 1")
    for name in ("train_epoch", "learn_epoch", "tracing_tau"):
        values = learning[:, LEARNING.index(name)]
        _require(values >= 1, f"the learning groups' {name}", values, "at least 1")
    shift = image.groups.format[image.learns][:, FORMAT.index("weight_exp")]
    inside = np.abs(shift.astype(int)) <= MOST_SHIFT
    _require(
        inside, "the learning groups' weight_exp", shift, f"not from {-MOST_SHIFT} to {MOST_SHIFT}"
    )
    _check_learned_rows(image)
    for group in np.flatnonzero(image.learns):
        _check_own_rows(image, int(group))


def _check_own_rows(image: "ChipImage", group: int) -> None:
    """Refuse axons that share rows: a trace belongs to an axon, so its weights must do so, too."""
    axons, rows = part(image.groups.axon_start, group), part(image.groups.row_start, group)
    own = np.array_equal(image.in_axons.row[axons], np.arange(rows.stop - rows.start))
    if not own or (image.rows.atoms[rows] != 1).any() or (image.in_axons.base[axons] < 0).any():
        raise ImageError(
            f"synapse group '{image.manifest.groups[group].label}' learns: each of its "
            "axons needs a row of its own, of one atom, and a base; compile the image again"
        )


def _check_learned_rows(image: "ChipImage") -> None:
    """Refuse rows that learn without a weight for each neuron of the on/off pairs of errors."""
    learns = np.repeat(image.learns, np.diff(image.groups.row_start))
    weights = row_lengths(image)[learns]
    block = np.repeat(image.groups.block, np.diff(image.groups.row_start))[learns]
    pairs = np.diff(image.blocks.start)[block] // 2
    _require(weights == 2 * pairs, "the size of rows that learn", weights, "not", 2 * pairs)
