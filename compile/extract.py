"""Discretised blocks -> the arrays of a chip image."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from nengo_loihi.block import Axon, LoihiBlock, Synapse, SynapseConfig
from nengo_loihi.builder import Model
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.build import Blocks
from spikeport.compile.image import ARITHMETIC, SCHEMA, ChipImage

LEARNING = ("on", "lr_int", "lr_exp", "tracing_tau", "tracing_mag", "train_epoch", "learn_epoch")


def extract(blocks: Blocks, chip: str) -> ChipImage:
    """Make the image of discretised blocks: one block a core, in the order they were built.

    Parameters
    ----------
    blocks : Blocks
        What `spikeport.compile.build.build` returned.
    chip : str
        The chip's name.
    """
    model = blocks.model
    synapses = [(b, s) for b, block in enumerate(model.blocks) for s in block.synapses]
    arrays = {
        "block_core": np.arange(len(model.blocks)),
        **_block_arrays(list(model.blocks)),
        **_synapse_arrays(synapses),
        **_row_arrays([synapse for _, synapse in synapses]),
        **_route_arrays(model, {s: i for i, (_, s) in enumerate(synapses)}),
        "input_size": np.array([i.n_neurons for i in model.inputs], dtype=int),
        **_output_arrays(model),
    }
    return ChipImage(_manifest(blocks, synapses, chip), arrays)


def _manifest(blocks: Blocks, synapses: list[tuple[int, Synapse]], chip: str) -> dict[str, Any]:
    model = blocks.model
    return {
        "schema": SCHEMA,
        "arithmetic": ARITHMETIC,
        "chip": chip,
        "dt_s": float(model.dt),
        "pes_error_scale": float(model.pes_error_scale),
        "synapse_format": list(SynapseConfig.params),
        "learning": list(LEARNING),
        "blocks": [{"label": blocks.labels[block]} for block in model.blocks],
        "synapses": [{"label": str(s.label).split("::")[-1]} for _, s in synapses],
        "inputs": [{"size": int(i.n_neurons)} for i in model.inputs],
        "outputs": [_output_entry(probe) for probe in model.probes],
    }


def _block_arrays(blocks: list[LoihiBlock]) -> dict[str, np.ndarray]:
    parts = [block.compartment for block in blocks]
    per_block = {
        "block_vmin": "vmin",
        "block_vmax": "vmax",
        "block_noise_offset": "noise_offset",
        "block_noise_exp": "noise_exp",
        "block_noise_at_membrane": "noise_at_membrane",
    }
    per_compartment = ("bias", "decay_u", "decay_v", "vth", "refract_delay", "enable_noise")
    return {
        "block_start": offsets(block.n_neurons for block in blocks),
        **{
            key: np.array([int(getattr(p, name)) for p in parts]) for key, name in per_block.items()
        },
        **{name: flat([getattr(p, name) for p in parts]) for name in per_compartment},
    }


def _synapse_arrays(synapses: list[tuple[int, Synapse]]) -> dict[str, np.ndarray]:
    groups = [synapse for _, synapse in synapses]
    config = [[int(getattr(s.synapse_cfg, p)) for p in SynapseConfig.params] for s in groups]
    return {
        "synapse_block": np.array([b for b, _ in synapses], dtype=int),
        "synapse_pop_type": np.array([s.pop_type for s in groups], dtype=int),
        "synapse_format": np.array(config, dtype=int).reshape(-1, len(SynapseConfig.params)),
        "synapse_learning": np.array([_learning(s) for s in groups], dtype=float).reshape(
            -1, len(LEARNING)
        ),
        "in_axon_start": offsets(s.n_axons for s in groups),
        "in_axon_row": flat([_axon_rows(s) for s in groups]),
        "in_axon_base": flat([_axon_bases(s) for s in groups]),
    }


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
    return np.zeros(synapse.n_axons, int) if bases is None else np.maximum(np.asarray(bases), -1)


def _row_arrays(groups: list[Synapse]) -> dict[str, np.ndarray]:
    rows = [w for synapse in groups for w in synapse.weights]
    return {
        "row_start": offsets(len(synapse.weights) for synapse in groups),
        "row_atoms": np.array([w.shape[0] for w in rows], dtype=int),
        "row_weight_start": offsets(w.size for w in rows),
        "weights": flat([w.ravel() for w in rows]),
        "indices": flat([i.ravel() for synapse in groups for i in synapse.indices]),
    }


def _route_arrays(model: Model, number: dict[Synapse, int]) -> dict[str, np.ndarray]:
    sources = [(0, i, block) for i, block in enumerate(model.blocks)]
    sources += [(1, i, source) for i, source in enumerate(model.inputs)]
    routes = [(kind, i, source, axon) for kind, i, source in sources for axon in source.axons]
    return {
        "route_input": np.array([kind for kind, *_ in routes], dtype=int),
        "route_source": np.array([i for _, i, *_ in routes], dtype=int),
        "route_synapse": np.array([number[axon.target] for *_, axon in routes], dtype=int),
        "route_start": offsets(source.n_neurons for _, _, source, _ in routes),
        "route_axon": flat([_axon_targets(axon, source.n_neurons) for *_, source, axon in routes]),
        "route_atom": flat([_axon_atoms(axon, source.n_neurons) for *_, source, axon in routes]),
    }


def _axon_targets(axon: Axon, n: int) -> np.ndarray:
    return np.maximum(np.asarray(axon.map_axon(np.arange(n))), -1)


def _axon_atoms(axon: Axon, n: int) -> np.ndarray:
    return np.asarray(axon.map_atoms(np.arange(n)))


def _output_arrays(model: Model) -> dict[str, np.ndarray]:
    start = dict(zip(model.blocks, offsets(b.n_neurons for b in model.blocks), strict=False))
    reads = [flat([start[b] + _selected(b, s) for b, s in _segments(p)]) for p in model.probes]
    weights = [_output_matrix(probe).ravel() for probe in model.probes]
    return {
        "output_start": offsets(len(r) for r in reads),
        "output_compartment": flat(reads),
        "output_weight_start": offsets(len(w) for w in weights),
        "output_weights": flat(weights, float),
    }


def _output_entry(probe: LoihiProbe) -> dict[str, Any]:
    matrix = _output_matrix(probe)
    kind = "matrix" if probe.is_transformed else "scale" if matrix.size else "none"
    return {
        "key": probe.key,
        "weights": kind,
        "shape": list(matrix.shape),
        "layout": _layout(probe),
        "segments": [len(_selected(*segment)) for segment in _segments(probe)],
        "order": None if probe.reindexing is None else [int(i) for i in probe.reindexing],
    }


def _output_matrix(probe: LoihiProbe) -> np.ndarray:
    """Weights of all segments below each other; () for none, (1,) for one factor for all."""
    if probe.is_transformed:
        return np.vstack(probe.weights)
    return np.zeros(0) if probe.weights[0] is None else np.asarray(probe.weights[0]).reshape(-1)


def _layout(probe: LoihiProbe) -> str:
    """C or F: how nengo-loihi holds the matrices, on which the rounding of a product depends."""
    return "C" if all(w is None or w.flags.c_contiguous for w in probe.weights) else "F"


def _segments(probe: LoihiProbe) -> Iterable[tuple[LoihiBlock, Any]]:
    return zip(probe.target, probe.slice, strict=True)


def _selected(block: LoihiBlock, selection: Any) -> np.ndarray:
    return np.arange(block.n_neurons)[selection]


def offsets(sizes: Iterable[int]) -> np.ndarray:
    """Where parts of the given sizes begin when laid end to end; one more entry for the end."""
    return np.concatenate([[0], np.cumsum(list(sizes))]).astype(np.int64)


def flat(arrays: Sequence[np.ndarray], dtype: type = int) -> np.ndarray:
    """The arrays laid end to end."""
    return np.concatenate(arrays) if len(arrays) else np.zeros(0, dtype)
