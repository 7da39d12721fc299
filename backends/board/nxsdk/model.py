"""An image as the model that nengo-loihi's hardware half takes, rebuilt from the image alone."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from nengo_loihi.block import Axon, LoihiBlock, Synapse
from nengo_loihi.inputs import SpikeInput
from nengo_loihi.probe import LoihiProbe

from spikeport.backends.nengo_loihi import load_blocks, load_inputs
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import NONE, flat

NOISE = ("noise_exp", "noise_offset", "noise_at_membrane")
"""Settings of noise, which are registers of a core."""


class Model(NamedTuple):
    """The fields of nengo-loihi's model that its hardware half reads, and the synapse groups."""

    blocks: list[LoihiBlock]
    synapses: list[Synapse]
    inputs: list[SpikeInput]
    probes: list[LoihiProbe]
    dt: float
    pes_error_scale: float


@dataclass(frozen=True, eq=False)
class Placement:
    """Blocks on cores; ``core`` has the core of each block, (n_blocks,)."""

    name: str
    core: np.ndarray

    @classmethod
    def single(cls, image: ChipImage) -> "Placement":
        """Return the placement for first tests on a board: one block on each core."""
        return cls("one block a core", np.arange(image.n_blocks))

    @classmethod
    def packed(cls, image: ChipImage) -> "Placement":
        """Return the image's own placement."""
        return cls("packed", image.blocks.core)

    @property
    def is_single(self) -> bool:
        """True if no two blocks are on one core."""
        return len(np.unique(self.core)) == len(self.core)

    @property
    def blocks_of(self) -> list[np.ndarray]:
        """Blocks of each core, in order."""
        n_cores = int(self.core.max(initial=-1)) + 1
        return [np.flatnonzero(self.core == core) for core in range(n_cores)]

    def compartments(self, image: ChipImage) -> np.ndarray:
        """Return the compartments of an image in the order of cores, (n_compartments,)."""
        order = np.argsort(self.core, kind="stable")
        starts = image.blocks.start
        return flat([np.arange(starts[b], starts[b + 1]) for b in order])


def model_of(image: ChipImage, placement: Placement) -> Model:
    """Return the model of an image; its outputs are read raw, for the host to decode.

    Blocks without noise take the noise settings of a block that shares their core: nengo-loihi's
    builder compares these settings even if noise is off.
    """
    blocks, synapses = load_blocks(image)
    _share_noise(blocks, placement)
    inputs = load_inputs(image, synapses)
    for source in inputs:
        if not source.axons and synapses:  # the builder asserts that every input has an axon
            source.add_axon(_nowhere(source.n_neurons, synapses[0]))
    return Model(
        blocks=blocks,
        synapses=synapses,
        inputs=inputs,
        probes=[_probe(image, i, blocks) for i in range(len(image.outputs))],
        dt=image.manifest.dt_s,
        pes_error_scale=image.manifest.pes_error_scale,
    )


def _share_noise(blocks: list[LoihiBlock], placement: Placement) -> None:
    for numbers in placement.blocks_of:
        states = [blocks[b].compartment for b in numbers]
        noisy = [state for state in states if state.enable_noise.any()]
        for state in states:
            if not state.enable_noise.any():
                for name in NOISE:
                    setattr(state, name, getattr((noisy or states)[0], name))


def _nowhere(n_sources: int, synapse: Synapse) -> Axon:
    """Return an axon that no source of an input reaches."""
    axon = Axon(0)
    axon.target = synapse
    axon.set_compartment_axon_map(np.full(n_sources, NONE))
    return axon


def _probe(image: ChipImage, number: int, blocks: list[LoihiBlock]) -> LoihiProbe:
    """Return the probe of an output: a slice of a block for each block that it reads in turn."""
    reads, starts = image.read_by(number), image.blocks.start
    owner = image.compartment_block[reads]
    segments = np.split(reads, 1 + np.flatnonzero(np.diff(owner)))
    owners = [image.compartment_block[segment[0]] for segment in segments]
    slices = [(s - starts[b]).tolist() for s, b in zip(segments, owners, strict=True)]
    key = image.manifest.outputs[number].key
    return LoihiProbe(target=[blocks[b] for b in owners], key=key, slice=slices)
