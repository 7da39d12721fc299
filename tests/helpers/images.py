"""Chip images made by hand, and hypothesis strategies for random ones."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hypothesis import strategies as st
from nengo_loihi.block import SynapseConfig

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import (
    BlockEntry,
    Encoding,
    GroupEntry,
    InputEntry,
    Manifest,
    OutputEntry,
)
from spikeport.compile.image.tables import BLOCK_SETTINGS, flat, offsets
from spikeport.compile.image.validation import LEARNING

KEYS = ("voltage", "current", "spiked")
PER_COMPARTMENT = ("bias", "decay_u", "decay_v", "vth", "refract_delay", "enable_noise")
INT32_MAX = 2**31 - 1


@dataclass
class Block:
    """A block of ``n`` compartments; a value of compartments is one number or ``n``."""

    n: int = 1
    core: int = 0
    vmin: int = -(2**23) + 1
    vmax: int = 2**23 - 1
    noise_offset: int = 0
    noise_exp: int = 7
    noise_at_membrane: int = 0
    bias: Any = 0
    decay_u: Any = 4095
    decay_v: Any = 0
    vth: Any = 2**23 - 1
    refract_delay: Any = 1
    enable_noise: Any = 0


@dataclass
class Group:
    """Synapses of a block: rows of (n_atoms, k) weights and indices, and its input axons."""

    weights: Sequence[Any]
    indices: Sequence[Any] | None = None
    axon_row: Sequence[int] | None = None
    axon_base: Sequence[int] | None = None
    block: int = 0
    pop_type: int = 0
    learning: Sequence[float] = (0,) * len(LEARNING)

    def __post_init__(self) -> None:
        """Fill in the defaults: targets 0, 1, 2 ..., one axon a row, bases 0."""
        self.weights = [np.atleast_2d(np.asarray(w, dtype=np.int64)) for w in self.weights]
        if self.indices is None:
            self.indices = [np.broadcast_to(np.arange(w.shape[1]), w.shape) for w in self.weights]
        if self.axon_row is None:
            self.axon_row = np.arange(len(self.weights))
        if self.axon_base is None:
            self.axon_base = np.zeros(len(self.axon_row), dtype=int)


@dataclass
class Route:
    """The axon, or -1, and the atom of each compartment of a block or each source of an input."""

    axon: Sequence[int]
    atom: Sequence[int] | None = None
    group: int = 0
    block: int | None = None
    input: int | None = None


@dataclass
class Output:
    """The values read from compartments, with or without a decoding matrix."""

    key: str
    compartments: Sequence[int]
    decoded: bool = False


@dataclass
class Parts:
    """The parts of an image."""

    blocks: list[Block] = field(default_factory=lambda: [Block()])
    groups: list[Group] = field(default_factory=list)
    inputs: list[int] = field(default_factory=list)
    routes: list[Route] = field(default_factory=list)
    outputs: list[Output] = field(default_factory=list)

    def image(self) -> ChipImage:
        """Return the image of these parts."""
        arrays = {**self._blocks(), **self._groups(), **self._routes(), **self._outputs()}
        return ChipImage.from_arrays(self._manifest(), arrays)

    def _manifest(self) -> Manifest:
        inputs = [
            InputEntry(f"input {i}", n, Encoding("spikes")) for i, n in enumerate(self.inputs)
        ]
        return Manifest(
            chip="none",
            dt_s=0.001,
            pes_error_scale=100.0,
            synapse_format=SynapseConfig.params,
            learning=LEARNING,
            weight_bits=tuple(SynapseConfig.WEIGHT_BITS_MAP),
            index_bits=tuple(SynapseConfig.INDEX_BITS_MAP),
            blocks=tuple(BlockEntry("ensemble", f"block {i}") for i in range(len(self.blocks))),
            groups=tuple(GroupEntry(f"group {i}") for i in range(len(self.groups))),
            inputs=tuple(inputs),
            outputs=tuple(self._output_entry(i, output) for i, output in enumerate(self.outputs)),
        )

    @staticmethod
    def _output_entry(number: int, output: Output) -> OutputEntry:
        n = len(output.compartments)
        return OutputEntry(
            name=f"output {number}",
            key=output.key,  # type: ignore[arg-type]
            weights="matrix" if output.decoded else "none",
            shape=(n, 1) if output.decoded else (0,),
            layout="C",
            segments=(n,),
        )

    def _blocks(self) -> dict[str, np.ndarray]:
        sizes = [block.n for block in self.blocks]
        return {
            "block_start": offsets(sizes),
            "block_core": np.array([b.core for b in self.blocks]),
            **{
                f"block_{k}": np.array([getattr(b, k) for b in self.blocks]) for k in BLOCK_SETTINGS
            },
            **{
                k: flat([np.broadcast_to(np.asarray(getattr(b, k)), b.n) for b in self.blocks])
                for k in PER_COMPARTMENT
            },
        }

    def _groups(self) -> dict[str, np.ndarray]:
        groups = self.groups
        rows = [w for group in groups for w in group.weights]
        config = SynapseConfig(weight_bits=7, fanout_type=1)
        form = [[getattr(config, name) for name in SynapseConfig.params]] * len(groups)
        return {
            "synapse_block": np.array([g.block for g in groups], dtype=int),
            "synapse_pop_type": np.array([g.pop_type for g in groups], dtype=int),
            "synapse_format": np.array(form, dtype=int).reshape(-1, len(config.params)),
            "synapse_learning": np.array([g.learning for g in groups], dtype=float).reshape(
                -1, len(LEARNING)
            ),
            "in_axon_start": offsets(len(g.axon_row) for g in groups),
            "in_axon_row": flat([np.asarray(g.axon_row, dtype=int) for g in groups]),
            "in_axon_base": flat([np.asarray(g.axon_base, dtype=int) for g in groups]),
            "row_start": offsets(len(g.weights) for g in groups),
            "row_atoms": np.array([len(w) for w in rows], dtype=int),
            "row_weight_start": offsets(w.size for w in rows),
            "weights": flat([w.ravel() for w in rows]),
            "indices": flat([np.ravel(i) for g in groups for i in g.indices]),
        }

    def _routes(self) -> dict[str, np.ndarray]:
        # blocks before inputs, as in compiled images
        routes = sorted(self.routes, key=lambda r: r.block is None)
        atoms = [np.zeros(len(r.axon)) if r.atom is None else r.atom for r in routes]
        return {
            "route_input": np.array([r.block is None for r in routes], dtype=int),
            "route_source": np.array(
                [r.input if r.block is None else r.block for r in routes], int
            ),
            "route_synapse": np.array([r.group for r in routes], dtype=int),
            "route_start": offsets(len(r.axon) for r in routes),
            "route_axon": flat([np.asarray(r.axon, dtype=int) for r in routes]),
            "route_atom": flat([np.asarray(a, dtype=int) for a in atoms]),
            "input_size": np.array(self.inputs, dtype=int),
        }

    def _outputs(self) -> dict[str, np.ndarray]:
        reads = [np.asarray(o.compartments, dtype=int) for o in self.outputs]
        weights = [np.ones(len(o.compartments) if o.decoded else 0) for o in self.outputs]
        return {
            "output_start": offsets(len(r) for r in reads),
            "output_compartment": flat(reads),
            "output_weight_start": offsets(len(w) for w in weights),
            "output_weights": flat(weights, float),
        }


@st.composite
def images(draw: st.DrawFn) -> ChipImage:
    """Draw small images that reach every corner of the arithmetic and of the wiring.

    Hypothesis draws the structure, which shrinks; a seed that it draws gives the numbers.
    """
    rng = np.random.RandomState(draw(st.integers(0, 2**32 - 1), label="numbers"))
    noisy = draw(st.booleans(), label="noisy")
    sizes = draw(st.lists(st.integers(1, 9), min_size=1, max_size=4), label="block sizes")
    blocks = [_block(rng, n, noisy) for n in sizes]
    cores = np.unique([block.core for block in blocks], return_inverse=True)[1]
    for block, core in zip(blocks, cores, strict=True):
        block.core = int(core)  # cores are numbered without a gap
    n_groups = draw(st.integers(0, 4), label="groups")  # fewer than blocks: some have no synapses
    largest = draw(st.sampled_from([255 * 64, 2**21, INT32_MAX]), label="largest weight")
    unit = draw(st.sampled_from([1, 64]), label="unit of weights")  # 64: sums have 16 bits
    groups = [_group(rng, blocks, largest, unit) for _ in range(n_groups)]
    inputs = draw(st.lists(st.integers(1, 6), max_size=3), label="inputs")
    routes = [_route(rng, blocks, groups, inputs) for _ in range(3 * n_groups)]
    outputs = [_output(rng, key, sum(sizes)) for key in KEYS for _ in range(rng.randint(3))]
    return Parts(blocks, groups, inputs, routes, outputs).image()


def _block(rng: np.random.RandomState, n: int, noisy: bool) -> Block:
    return Block(
        n=n,
        core=rng.randint(3),
        vmin=-(2 ** rng.randint(32)) + 1,
        vmax=2 ** (9 + 2 * rng.randint(8)) - 1,
        noise_offset=rng.randint(-64, 65),
        noise_exp=rng.randint(24),
        noise_at_membrane=rng.randint(2),
        bias=_signed(rng, n, rng.choice([1, 4095 * 128, 2**23, INT32_MAX])),
        decay_u=_between(rng, n, 0, 4095),
        decay_v=_between(rng, n, 0, 4095),
        vth=rng.choice([-1, 0, 64, 2**14, 2**17 * 64 - 64, 2**23 - 1], size=n),
        refract_delay=_between(rng, n, 0, 63) * rng.randint(2, size=n),
        enable_noise=noisy * rng.randint(2, size=n),
    )


def _between(rng: np.random.RandomState, n: int, low: int, high: int) -> np.ndarray:
    """Draw numbers from a range, its ends among them."""
    return np.clip(rng.randint(low - 500, high + 501, size=n), low, high)


def _signed(rng: np.random.RandomState, size: Any, largest: int) -> np.ndarray:
    """Draw numbers of all magnitudes up to the largest, 0 and the largest among them."""
    magnitude = (largest * 2.0 ** -rng.randint(0, 25, size=size)).astype(np.int64)
    return magnitude * rng.choice([-1, 0, 1], size=size)


def _group(rng: np.random.RandomState, blocks: list[Block], largest: int, unit: int) -> Group:
    block = rng.randint(len(blocks))
    n, atoms = blocks[block].n, [rng.choice([1, 1, 3]) for _ in range(rng.randint(1, 5))]
    lengths = [rng.randint(0, n + 1) for _ in atoms]
    span = [rng.randint(1, n + 1) for _ in atoms]  # range of indices: in a narrow one they repeat
    rows = rng.randint(len(atoms), size=rng.randint(1, 7))
    return Group(
        block=block,
        weights=[
            _signed(rng, (a, k), largest) // unit * unit
            for a, k in zip(atoms, lengths, strict=True)
        ],
        indices=[_indices(rng, (a, k), s) for a, k, s in zip(atoms, lengths, span, strict=True)],
        axon_row=rows,
        axon_base=[rng.randint(-1, n - span[row] + 1) for row in rows],
        pop_type=rng.choice([0, 16, 32]),
    )


def _indices(rng: np.random.RandomState, shape: tuple[int, int], span: int) -> np.ndarray:
    indices = rng.randint(span, size=shape)
    return np.sort(indices, axis=1) if rng.randint(2) else indices


def _route(
    rng: np.random.RandomState, blocks: list[Block], groups: list[Group], inputs: list[int]
) -> Route:
    number, source = rng.randint(len(groups)), rng.randint(len(blocks) + len(inputs))
    group, of_block = groups[number], source < len(blocks)
    size = blocks[source].n if of_block else inputs[source - len(blocks)]
    axon = rng.randint(-1, len(group.axon_row), size=size)
    atoms = np.array([len(group.weights[row]) for row in group.axon_row])
    return Route(
        axon=axon,
        atom=np.where(axon < 0, 0, rng.randint(6, size=size) % atoms[axon]),
        group=number,
        block=source if of_block else None,
        input=None if of_block else source - len(blocks),
    )


def _output(rng: np.random.RandomState, key: str, n: int) -> Output:
    return Output(key, rng.randint(n, size=rng.randint(1, 2 * n)), decoded=bool(rng.randint(2)))
