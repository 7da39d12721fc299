"""The stages between a network and its image: blocks in floating point, and blocks of integers.

nengo-loihi's discretiser overwrites the floats of its objects with integers. Here the stages are
separate values: blocks are copied before anything in them changes.
"""

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from nengo_loihi.block import Compartment, LoihiBlock, Synapse
from nengo_loihi.builder import Model
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.ground.filters import Passage
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.manifest import BlockEntry, Filter, InputEntry
from spikeport.compile.loihi.events import EventSteps


class OutputName(NamedTuple):
    """The name of an output, and its filter on the host."""

    name: str
    filter: Filter | None


@dataclass(frozen=True)
class FloatBlocks:
    """A network as nengo-loihi built it, in floating point.

    Attributes
    ----------
    model : Model
        nengo-loihi's model: the host's part, and the wiring of blocks. It does not change any more.
    blocks : tuple of LoihiBlock
        The blocks, in the model's order. A block that a pass changed replaces the original.
    entries : tuple of BlockEntry
        The owner and kind of each block.
    inputs : tuple of InputEntry
        The name and encoding of each of the model's inputs.
    outputs : tuple of OutputName
        The name and filter of each of the model's probes.
    events : mapping of int to EventSteps
        The spikes of inputs that are read from files, by the input's number.
    passages : tuple of Passage
        The filters of each connection that ends on the chip.
    ends : mapping of str to tuple of str
        The names of a connection that owns blocks and of its ends, by the connection's name.
    """

    model: Model
    blocks: tuple[LoihiBlock, ...]
    entries: tuple[BlockEntry, ...]
    inputs: tuple[InputEntry, ...]
    outputs: tuple[OutputName, ...]
    events: Mapping[int, EventSteps] = field(default_factory=dict)
    passages: tuple[Passage, ...] = ()
    ends: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def labels(self) -> tuple[str, ...]:
        """The name of each block."""
        return tuple(entry.label for entry in self.entries)

    def about(self, owner: str) -> tuple[str, ...]:
        """Return the name of an owner of blocks, and those of its ends if it is a connection."""
        return self.ends.get(owner, (owner,))

    def with_blocks(self, blocks: Iterable[LoihiBlock]) -> "FloatBlocks":
        """Return a copy with other blocks."""
        return replace(self, blocks=tuple(blocks))


@dataclass(frozen=True)
class IntegerBlocks:
    """A network after nengo-loihi's discretiser, in integers.

    Attributes
    ----------
    floats : FloatBlocks
        The blocks in floating point.
    blocks : tuple of LoihiBlock
        The blocks of integers, in the same order.
    probes : tuple of LoihiProbe
        The model's probes, whose weights undo the blocks' scales.
    errors : tuple of BlockError
        The rounding error of each block.
    """

    floats: FloatBlocks
    blocks: tuple[LoihiBlock, ...]
    probes: tuple[LoihiProbe, ...]
    errors: tuple[BlockError, ...]

    @property
    def model(self) -> Model:
        """nengo-loihi's model, which has the host's part of the network."""
        return self.floats.model

    @property
    def rounded_away(self) -> list[int]:
        """The numbers of the synapse groups that lost all their weights to rounding."""
        pairs = zip(_synapses(self.floats.blocks), _synapses(self.blocks), strict=True)
        return [
            number
            for number, (wanted, found) in enumerate(pairs)
            if not (found.learning or _any(found.weights)) and _any(wanted.weights)
        ]


def _synapses(blocks: Iterable[LoihiBlock]) -> Iterator[Synapse]:
    return (synapse for block in blocks for synapse in block.synapses)


def _any(weights: Iterable[np.ndarray]) -> bool:
    return any(some.any() for some in weights)


def first_of(blocks: LoihiBlock | list[LoihiBlock]) -> LoihiBlock:
    """Return the first block of an object, which nengo-loihi may have split into several."""
    return blocks[0] if isinstance(blocks, list) else blocks


def copied(block: LoihiBlock) -> LoihiBlock:
    """Return a copy of a block that can be changed; it shares the axons of the original."""
    new = copy.copy(block)
    new.compartment = _copied_arrays(block.compartment)
    new.synapses = [_copied_synapse(synapse) for synapse in block.synapses]
    return new


def copied_probe(probe: LoihiProbe) -> LoihiProbe:
    """Return a copy of a probe whose weights can be changed; it shares the original's targets."""
    new = copy.copy(probe)
    new.weights = [
        # "K" keeps the order in memory, on which the rounding of products depends.
        None if weights is None else weights.copy(order="K")
        for weights in probe.weights
    ]
    return new


def _copied_arrays(compartment: Compartment) -> Compartment:
    new = copy.copy(compartment)
    for name, value in vars(compartment).items():
        if isinstance(value, np.ndarray):
            setattr(new, name, value.copy())
    return new


def _copied_synapse(synapse: Synapse) -> Synapse:
    new = copy.copy(synapse)
    new.synapse_cfg = copy.copy(synapse.synapse_cfg)
    new.weights = [weights.copy() for weights in synapse.weights]
    return new
