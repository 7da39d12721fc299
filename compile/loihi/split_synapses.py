"""nengo-loihi's split of a group of synapses over blocks, with arrays in place of sets.

nengo-loihi looks up every target of every axon in a set for every block. Here targets that several
axons share, as most do, are looked up once, in an array. Groups, order and bits are the same, but
nengo-loihi's checks are left out.
"""

import contextlib
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import nengo_loihi.builder.split_blocks as split_blocks
import numpy as np
from nengo_loihi.block import LoihiBlock, Synapse

from spikeport.compile.loihi.replaced import replaced

MOST_BASES = 256
"""A bound on the base of an axon's targets on the chip, which is less."""


class _Axon(NamedTuple):
    """An axon that is used: its row of weights, and the key of its targets in the whole block."""

    row: int
    targets: bytes


class _Cut(NamedTuple):
    """The part of some targets that lies in a block.

    ``kept`` selects it among the targets; ``base`` + ``offset`` are its compartments in the block.
    """

    kept: np.ndarray
    base: int
    offset: np.ndarray


def split_synapse(
    old_block: LoihiBlock,
    old: Synapse,
    new_blocks: Mapping[LoihiBlock, Any],
    validate: object = None,
) -> OrderedDict[Synapse, list[int]]:
    """Split a group of synapses, and return the old axons that each part needs.

    Parameters
    ----------
    old_block : LoihiBlock
        The block that was split.
    old : Synapse
        A group of its synapses.
    new_blocks : mapping of LoihiBlock to IndicesList
        The blocks it was split into, each with its compartments in the old one.
    validate : ValidationLevel
        Not used: nengo-loihi's checks are left out.
    """
    axons, targets = _axons(old)
    parts: OrderedDict[Synapse, list[int]] = OrderedDict()
    for number, (block, compartments) in enumerate(new_blocks.items()):
        cuts = _cuts(old, old_block.n_neurons, compartments.list, targets)
        mine = [axon for axon, (_, key) in axons.items() if key in cuts]
        if mine:
            part = _part(old, [axons[axon] for axon in mine], cuts)
            if old.label is not None:
                part.label = f"{old.label}[{number}]"
            block.add_synapse(part)
            parts[part] = mine
    return parts


def _axons(old: Synapse) -> tuple[dict[int, _Axon], dict[bytes, np.ndarray]]:
    """Return the axons that are used, by number, and the different targets they have."""
    axons: dict[int, _Axon] = {}
    targets: dict[bytes, np.ndarray] = {}
    for number in range(old.n_axons):
        base = old.axon_compartment_base(number)
        if base is not None:
            row = int(old.axon_weight_idx(number))
            reached = base + old.indices[row][0]
            key = reached.tobytes()
            targets.setdefault(key, reached)
            axons[number] = _Axon(row, key)
    return axons, targets


def _cuts(
    old: Synapse, n: int, compartments: list[int], targets: Mapping[bytes, np.ndarray]
) -> dict[bytes, _Cut]:
    """Return the part of each set of targets that lies among some of n compartments, if any."""
    place = np.full(n, -1)
    place[compartments] = np.arange(len(compartments))
    cuts = {}
    for key, reached in targets.items():
        new = place[reached]
        kept = new >= 0
        if kept.any():
            new = new[kept]
            shared = old.axon_to_weight_map is not None
            # The place of the lowest old target, as in nengo-loihi, even if it is not the lowest in
            # the new block.
            base = int(new[np.argmin(reached[kept])]) % MOST_BASES if shared else 0
            cuts[key] = _Cut(kept, base, new - base)
    return cuts


def _part(old: Synapse, axons: list[_Axon], cuts: Mapping[bytes, _Cut]) -> Synapse:
    """Return the part of a group that some axons read, with equal rows stored once."""
    rows: list[tuple[np.ndarray, np.ndarray]] = []
    number: dict[tuple[bytes, bytes], int] = {}
    of_axon = []
    for axon in axons:
        cut = cuts[axon.targets]
        weights = np.ascontiguousarray(old.weights[axon.row][:, cut.kept])
        # Rows of equal weights and targets are stored once, whatever their axons' bases.
        key = weights.tobytes(), cut.offset.tobytes()
        if key not in number:
            number[key] = len(rows)
            rows.append((weights, np.tile(cut.offset, (len(weights), 1))))
        of_axon.append(number[key])
    part = Synapse(len(axons))
    part._set_weights_indices(
        [weights for weights, _ in rows],
        [index for _, index in rows],
        weight_dtype=rows[0][0].dtype,
        compression=old.synapse_cfg.compression,
    )
    part.axon_to_weight_map = np.asarray(of_axon)
    part.axon_compartment_bases = np.asarray([cuts[axon.targets].base for axon in axons])
    part.pop_type = old.pop_type
    return part


@contextlib.contextmanager
def split_by_tables() -> Iterator[None]:
    """Let nengo-loihi's builder split groups of synapses with `split_synapse`."""
    with replaced(split_blocks, "split_synapse", split_synapse):
        yield
