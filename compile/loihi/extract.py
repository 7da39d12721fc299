"""The tables of a chip image, from integer blocks."""

from collections.abc import Iterable, Sequence
from typing import TypedDict

import numpy as np
from nengo_loihi.block import Axon, LoihiBlock, Synapse, SynapseConfig
from nengo_loihi.builder import Model
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import GroupEntry, Manifest, OutputEntry
from spikeport.compile.image.tables import (
    BLOCK_SETTINGS,
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
    RowTables,
    Synapses,
    flat,
    offsets,
)
from spikeport.compile.image.validation import LEARNING
from spikeport.compile.loihi.blocks import IntegerBlocks, OutputName


def extract(blocks: IntegerBlocks, chip: str) -> ChipImage:
    """Make the image of discretised blocks: one block a core, in the order they were built.

    Parameters
    ----------
    blocks : IntegerBlocks
        The return value of `spikeport.compile.loihi.discretise.discretise`.
    chip : str
        The chip's name.
    """
    owned = [(b, synapse) for b, block in enumerate(blocks.blocks) for synapse in block.synapses]
    groups = [synapse for _, synapse in owned]
    return ChipImage(
        manifest=_manifest(blocks, groups, chip),
        blocks=_blocks(blocks.blocks),
        compartments=_compartments(blocks.blocks),
        groups=_groups([block for block, _ in owned], groups),
        in_axons=InAxons(
            row=flat([_axon_rows(synapse) for synapse in groups]),
            base=flat([_axon_bases(synapse) for synapse in groups]),
        ),
        **_rows(groups),
        **_routes(blocks.model),
        inputs=Inputs(size=np.array([i.n_neurons for i in blocks.model.inputs], dtype=int)),
        **_outputs(blocks),
    )


def _manifest(blocks: IntegerBlocks, groups: list[Synapse], chip: str) -> Manifest:
    model = blocks.model
    return Manifest(
        chip=chip,
        dt_s=float(model.dt),
        pes_error_scale=float(model.pes_error_scale),
        synapse_format=SynapseConfig.params,
        learning=LEARNING,
        weight_bits=tuple(SynapseConfig.WEIGHT_BITS_MAP),
        index_bits=tuple(SynapseConfig.INDEX_BITS_MAP),
        blocks=blocks.floats.entries,
        groups=tuple(GroupEntry(str(synapse.label).split("::")[-1]) for synapse in groups),
        inputs=blocks.floats.inputs,
        outputs=tuple(map(_output_entry, blocks.floats.outputs, blocks.probes)),
    )


def _blocks(blocks: Sequence[LoihiBlock]) -> Blocks:
    return Blocks(
        start=offsets(block.n_neurons for block in blocks),
        core=np.arange(len(blocks)),
        **{
            name: np.array([int(getattr(block.compartment, name)) for block in blocks])
            for name in BLOCK_SETTINGS
        },
    )


def _compartments(blocks: Sequence[LoihiBlock]) -> Compartments:
    return Compartments(
        **{
            name: flat([getattr(block.compartment, name) for block in blocks])
            for name in Compartments.columns()
        }
    )


def _groups(block: list[int], groups: list[Synapse]) -> Groups:
    config = [[int(getattr(s.synapse_cfg, p)) for p in SynapseConfig.params] for s in groups]
    learning = np.array([_learning(synapse) for synapse in groups], dtype=float)
    return Groups(
        block=np.array(block, dtype=int),
        pop_type=np.array([synapse.pop_type for synapse in groups], dtype=int),
        format=np.array(config, dtype=int).reshape(-1, len(SynapseConfig.params)),
        learning=learning.reshape(-1, len(LEARNING)),
        axon_start=offsets(synapse.n_axons for synapse in groups),
        row_start=offsets(len(synapse.weights) for synapse in groups),
    )


def _learning(s: Synapse) -> tuple[float, ...]:
    if not s.learning:
        return (0.0,) * len(LEARNING)
    rates = (s._lr_int, s._lr_exp, s.tracing_tau, s.tracing_mag)
    return (1.0, *rates, s.train_epoch, s.learn_epoch)


def _axon_rows(synapse: Synapse) -> np.ndarray:
    rows = synapse.axon_to_weight_map
    return np.arange(synapse.n_axons) if rows is None else np.array(list(rows))


def _axon_bases(synapse: Synapse) -> np.ndarray:
    bases = synapse.axon_compartment_bases
    # nengo-loihi marks unused axons by any negative number, images only by -1.
    return np.zeros(synapse.n_axons, int) if bases is None else np.maximum(np.asarray(bases), -1)


def _rows(groups: list[Synapse]) -> RowTables:
    weights = [w for synapse in groups for w in synapse.weights]
    return {
        "rows": Rows(
            atoms=np.array([w.shape[0] for w in weights], dtype=int),
            start=offsets(w.size for w in weights),
        ),
        "synapses": Synapses(
            weight=flat([w.ravel() for w in weights]),
            index=flat([i.ravel() for synapse in groups for i in synapse.indices]),
        ),
    }


class _RouteTables(TypedDict):
    routes: Routes
    out_axons: OutAxons


def _routes(model: Model) -> _RouteTables:
    synapses = (synapse for block in model.blocks for synapse in block.synapses)
    number = {synapse: i for i, synapse in enumerate(synapses)}
    sources = [(0, i, block) for i, block in enumerate(model.blocks)]
    # Sources are numbered in this order: blocks first, then inputs.
    sources += [(1, i, source) for i, source in enumerate(model.inputs)]
    routes = [(kind, i, source, axon) for kind, i, source in sources for axon in source.axons]
    return {
        "routes": Routes(
            from_input=np.array([kind for kind, *_ in routes], dtype=int),
            source=np.array([i for _, i, *_ in routes], dtype=int),
            group=np.array([number[axon.target] for *_, axon in routes], dtype=int),
            start=offsets(source.n_neurons for _, _, source, _ in routes),
        ),
        "out_axons": OutAxons(
            axon=flat([_axon_targets(axon, source.n_neurons) for *_, source, axon in routes]),
            atom=flat([_axon_atoms(axon, source.n_neurons) for *_, source, axon in routes]),
        ),
    }


def _axon_targets(axon: Axon, n: int) -> np.ndarray:
    result: np.ndarray = np.maximum(np.asarray(axon.map_axon(np.arange(n))), -1)
    return result


def _axon_atoms(axon: Axon, n: int) -> np.ndarray:
    return np.asarray(axon.map_atoms(np.arange(n)))


class _OutputTables(TypedDict):
    outputs: Outputs
    reads: Reads
    decoders: Decoders


def _outputs(blocks: IntegerBlocks) -> _OutputTables:
    built, probes = blocks.model.blocks, blocks.probes
    start = dict(zip(built, offsets(b.n_neurons for b in built), strict=False))
    reads = [flat([start[b] + _selected(b, s) for b, s in _segments(p)]) for p in probes]
    weights = [_output_matrix(probe).ravel() for probe in probes]
    return {
        "outputs": Outputs(
            start=offsets(len(r) for r in reads), weight_start=offsets(len(w) for w in weights)
        ),
        "reads": Reads(compartment=flat(reads)),
        "decoders": Decoders(weight=flat(weights, float)),
    }


def _output_entry(named: OutputName, probe: LoihiProbe) -> OutputEntry:
    matrix = _output_matrix(probe)
    return OutputEntry(
        name=named.name,
        key=probe.key,
        weights="matrix" if probe.is_transformed else "scale" if matrix.size else "none",
        shape=matrix.shape,
        # Kept because BLAS rounds a product depending on the order of its matrix in memory.
        layout="C" if _in_c_order(probe) else "F",
        segments=tuple(len(_selected(*segment)) for segment in _segments(probe)),
        order=None if probe.reindexing is None else tuple(int(i) for i in probe.reindexing),
        filter=named.filter,
    )


def _output_matrix(probe: LoihiProbe) -> np.ndarray:
    """Return the weights of all segments below each other; (0,) for none, (1,) for one factor."""
    if probe.is_transformed:
        return np.vstack(probe.weights)
    return np.zeros(0) if probe.weights[0] is None else np.asarray(probe.weights[0]).reshape(-1)


def _in_c_order(probe: LoihiProbe) -> bool:
    """Return whether nengo-loihi's matrices are in C order, on which rounding depends."""
    return all(w is None or w.flags.c_contiguous for w in probe.weights)


def _segments(probe: LoihiProbe) -> Iterable[tuple[LoihiBlock, slice | list[int]]]:
    return zip(probe.target, probe.slice, strict=True)


def _selected(block: LoihiBlock, selection: slice | list[int]) -> np.ndarray:
    return np.arange(block.n_neurons)[selection]
