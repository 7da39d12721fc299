"""A chip image as a NIR graph, in the chip's integers.

Each block is a node of CubaLIF neurons, for which Euler's method with time step dt gives

    I <- (1 - d_u) I + q,   v <- (1 - d_v) v + I + bias,   spike where v > threshold

with the image's own numbers: tau_syn = dt / d_u, tau_mem = dt / d_v, w_in = tau_syn / dt,
R = tau_mem / dt, v_leak = bias / d_v. A block whose voltage is read and that sends no spikes is a
node of CubaLI neurons. Each edge takes one step. A run has the chip's spikes if its decays have 12
bits and round towards zero, and if it keeps the voltage limits and rest steps of the metadata.
"""

import io
import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from spikeport import __version__
from spikeport.atomic import atomic_path
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.deliveries import first_sources, synapses_of
from spikeport.compile.image.tables import part
from spikeport.constants import DECAY_UNITS
from spikeport.errors import UsageError
from spikeport.extras import missing

NO_DECAY = DECAY_UNITS**2
"""Steps of the time constant that stands for no decay: in 12 bits, its decay is zero."""

ENTRIES = 2**27
"""Most entries of all matrices, half a GiB of weights or a GiB of decoders: NIR stores zeros."""


def export(image: ChipImage, path: str | Path) -> None:
    """Write an image as a NIR graph, whole or not at all.

    Raises
    ------
    UsageError
        If the image learns, has noise, reads voltages or currents, or is too large to be written as
        matrices.
    MissingExtraError
        If the package nir is absent.
    """
    nir, path = _nir(), Path(path)
    _check(image.checked)
    graph = _Exporter(image, nir).graph()
    # In memory first: on a full disk HDF5's library ends the process instead of raising an error.
    content = io.BytesIO()
    nir.write(content, graph)
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.getbuffer())


def _nir() -> ModuleType:
    try:
        return import_module("nir")
    except ModuleNotFoundError as error:
        raise missing("writing a NIR graph", error.name, "nir") from error


def _check(image: ChipImage) -> None:
    for what, there in (
        ("learns", image.learns.any()),
        ("has noise", image.compartments.enable_noise.any()),
    ):
        if there:
            raise UsageError(
                f"image {image.digest[:12]} {what}, which NIR cannot express; cure: compile the "
                "network without it"
            )
    for entry in image.manifest.outputs:
        if entry.key == "current" or (entry.key == "voltage" and entry.weights != "matrix"):
            raise UsageError(
                f"image {image.digest[:12]}: output '{entry.name}' reads a {entry.key}, which NIR "
                "cannot express; cure: probe spikes or values"
            )


def _readouts(image: ChipImage) -> set[int]:
    """Return the blocks whose voltage is read, and which send no spikes."""
    read = set(image.compartment_block[image.readouts].tolist())
    return read - set(image.routes.source[image.routes.from_input == 0].tolist())


class _Exporter:
    """The nodes and edges of an image."""

    def __init__(self, image: ChipImage, nir: ModuleType) -> None:
        self._image, self._nir = image, nir
        self._dt_s = image.manifest.dt_s
        self._nodes: dict[str, Any] = {}
        self._edges: list[tuple[str, str]] = []
        self._left = ENTRIES
        self._sizes = np.diff(image.blocks.start).tolist()
        self._readouts = _readouts(image)

    def graph(self) -> Any:
        """Return the graph."""
        image, nir = self._image, self._nir
        for number, entry in enumerate(image.manifest.inputs):
            self._nodes[f"input{number}"] = nir.Input(
                input_type={"input": np.array([entry.size])}, metadata={"label": entry.name}
            )
        for block in range(image.n_blocks):
            self._nodes[f"block{block}"] = self._block(block)
        self._add_weights()
        self._add_outputs()
        return nir.NIRGraph(
            nodes=self._nodes, edges=self._edges, metadata=self._metadata(), type_check=False
        )

    def _block(self, block: int) -> Any:
        mine, of = part(self._image.blocks.start, block), self._image.compartments
        current = (of.decay_u[mine] + 1) / DECAY_UNITS  # the chip adds 1
        voltage = np.where(of.decay_v[mine] > 0, of.decay_v[mine] / DECAY_UNITS, 1 / NO_DECAY)
        values = {
            "tau_syn": self._dt_s / current,
            "tau_mem": self._dt_s / voltage,
            "w_in": 1 / current,
            "r": 1 / voltage,
            "v_leak": of.bias[mine] / voltage,
            "metadata": self._of_block(block, mine),
        }
        if block in self._readouts:
            return self._nir.CubaLI(**values)
        threshold = of.vth[mine].astype(float)
        reset = np.zeros_like(threshold)
        return self._nir.CubaLIF(**values, v_threshold=threshold, v_reset=reset)

    def _of_block(self, block: int, mine: slice) -> dict[str, Any]:
        blocks = self._image.blocks
        return {
            "label": self._image.manifest.blocks[block].label,
            "core": int(blocks.core[block]),
            "v_min": int(blocks.vmin[block]),
            "v_max": int(blocks.vmax[block]),
            "rest_steps": np.maximum(self._image.compartments.refract_delay[mine] - 1, 0),
        }

    def _add_weights(self) -> None:
        """Add a matrix for each pair of a source and a block."""
        matrices: dict[tuple[str, int], np.ndarray] = {}
        for source, block, rows, columns, weights in self._synapses():
            key = source, block
            if key not in matrices:
                size = self._sizes[block], self._source_size(source)
                matrices[key] = self._zeros(size, np.float32)
            np.add.at(matrices[key], (rows, columns), weights)
        for (source, block), matrix in matrices.items():
            self._link(source, f"{source}_block{block}", f"block{block}", matrix)

    def _synapses(self) -> Iterator[tuple[str, int, np.ndarray, np.ndarray, np.ndarray]]:
        """Yield source, block, rows, columns and weights of each route."""
        image, routes = self._image, self._image.routes
        first = first_sources(image)
        for number, synapses in enumerate(synapses_of(image)):
            of, block = int(routes.source[number]), int(image.groups.block[routes.group[number]])
            yield (
                f"input{of}" if routes.from_input[number] else f"block{of}",
                block,
                synapses.target - image.blocks.start[block],
                synapses.source - first[number],
                image.synapses.weight[synapses.number],
            )

    def _zeros(self, size: tuple[int, int], kind: type[np.floating]) -> np.ndarray:
        """Return a matrix of zeros; UsageError if all matrices take too many entries."""
        self._left -= size[0] * size[1]
        if self._left < 0:
            raise UsageError(
                f"image {self._image.digest[:12]}: its matrices have more than {ENTRIES:,} "
                "entries, zeros among them; cure: compile it without the pass fuse, or probe fewer "
                "neurons"
            )
        return np.zeros(size, dtype=kind)

    def _source_size(self, source: str) -> int:
        if source.startswith("input"):
            return int(self._image.inputs.size[int(source.removeprefix("input"))])
        size: int = self._sizes[int(source.removeprefix("block"))]
        return size

    def _add_outputs(self) -> None:
        """Add a node for each output, with a matrix of its decoders for each block it reads."""
        image = self._image
        for number, entry in enumerate(image.manifest.outputs):
            name = f"output{number}"
            self._nodes[name] = self._nir.Output(
                output_type={"output": np.array([entry.size])}, metadata={"label": entry.name}
            )
            read = image.read_by(number)
            for block in np.unique(image.compartment_block[read]).tolist():
                here = image.compartment_block[read] == block
                matrix = self._zeros((entry.size, self._sizes[block]), np.float64)
                local = read[here] - image.blocks.start[block]
                self._add_decoders(matrix, number, local, here)
                self._link(f"block{block}", f"{name}_block{block}", name, matrix)

    def _add_decoders(
        self, matrix: np.ndarray, number: int, local: np.ndarray, here: np.ndarray
    ) -> None:
        """Add an output's weights for one block to a matrix, (n_values, n_compartments).

        ``local`` are the compartments that the output reads ``here``, counted within the block.
        """
        image, entry = self._image, self._image.manifest.outputs[number]
        values = image.decoders.weight[part(image.outputs.weight_start, number)]
        if entry.weights == "matrix":
            np.add.at(matrix.T, local, values.reshape(entry.shape)[here])
            return
        # Each value is the one compartment that it reads, scaled.
        order = np.arange(entry.size) if entry.order is None else np.array(entry.order)
        rows = np.flatnonzero(here[order])
        positions = np.cumsum(here)[order[rows]] - 1
        weight = values[0] if entry.weights == "scale" else 1.0
        np.add.at(matrix, (rows, local[positions]), weight)

    def _link(self, source: str, name: str, target: str, weight: np.ndarray) -> None:
        self._nodes[name] = self._nir.Linear(weight=weight)
        self._edges += [(source, name), (name, target)]

    def _metadata(self) -> dict[str, Any]:
        """Return the values that NIR has no field for."""
        manifest = self._image.manifest
        return {
            "spikeport": __version__,
            "image": self._image.digest,
            "chip": manifest.chip,
            "arithmetic": manifest.arithmetic,
            "dt": self._dt_s,
            "decay_bits": 12,
            "edge_steps": 1,
            "manifest": json.dumps(json.loads(manifest.to_json()), sort_keys=True),
        }
