"""nengo-loihi's emulator beside the native backend, with a comparison after every step."""

from collections.abc import Iterator
from typing import Any

import nengo_loihi.emulator
import nengo_loihi.simulator
import numpy as np
from nengo_loihi.emulator import EmulatorInterface

from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import BlockEntry, Encoding, InputEntry
from spikeport.compile.image.tables import offsets
from spikeport.compile.loihi.blocks import FloatBlocks, IntegerBlocks, OutputName
from spikeport.compile.loihi.extract import extract
from tests.shadow.tally import TALLY


class ShadowMismatchError(AssertionError):
    """A difference between the two emulators."""


class ShadowEmulator(EmulatorInterface):
    """Emulator that runs both emulators, and returns the results of nengo-loihi's."""

    def __init__(self, model: Any, seed: int | None = None) -> None:
        super().__init__(model, seed=seed)
        self._native: NativeChip | None = None
        if self.block_info.dtype != np.int32:
            TALLY.say("runs blocks of floats, which have no chip image")
            return
        TALLY.say("makes an emulator, but no step of it")
        image = image_of(model)
        self._native = NativeChip(image, self.seed)
        synapses = [synapse for block in model.blocks for synapse in block.synapses]
        self._groups = {synapse: group for group, synapse in enumerate(synapses)}
        self._errors: dict[int, np.ndarray] = {}
        self._expected: list[list[int]] = [[] for _ in self.inputs]

    def host2chip(self, spikes: Any, errors: Any) -> None:
        super().host2chip(spikes, errors)
        if self._native is not None:
            self._errors = {self._groups[synapse]: error for synapse, _, error in errors}
            if len(self._errors) < len(errors):
                raise ShadowMismatchError("two errors of one step for one synapse group")

    def step(self) -> None:
        if self._native is None:
            super().step()
            return
        # read before the emulator pops them; the native chip took them in the step before
        arriving = [sorted(source.spikes.get(self.t, [])) for source in self.inputs]
        if arriving != self._expected:
            raise ShadowMismatchError(f"step {self.t + 1}: spikes came after their step")
        super().step()
        sent = [_sources(source.spikes.get(self.t, [])) for source in self.inputs]
        self._expected = [sorted(sources) for sources in sent]
        outputs = self._native.step(self._counted_through(sent), self._errors)
        for name, ours, theirs in self._pairs(outputs):
            if not np.array_equal(ours, theirs):
                TALLY.mismatch(f"step {self.t}: {name}")
                raise ShadowMismatchError(f"step {self.t}: {name} differs")
        TALLY.step(spikes=int(self.compartment.spiked.sum()), n=self.compartment.n_compartments)

    def _counted_through(self, sent: list[np.ndarray]) -> np.ndarray:
        """Return the spikes of all inputs in one array, as a chip takes them."""
        firsts = offsets(source.n_neurons for source in self.inputs)
        parts = [first + sources for first, sources in zip(firsts, sent, strict=False)]
        return np.concatenate([np.zeros(0, dtype=int), *parts])

    def _pairs(self, outputs: list[np.ndarray]) -> Iterator[tuple[str, Any, Any]]:
        ours, theirs = self._native.state, self.compartment
        yield "voltage", ours.v, theirs.voltage
        yield "current", ours.u, theirs.current
        yield "input", ours.q, theirs.input[0]
        yield "spiked", ours.spiked[: theirs.n_compartments], theirs.spiked
        yield "refractory count", ours.refractory, theirs.ref_count
        yield "spike count", ours.spike_count, theirs.spike_count
        for i, (probe, output) in enumerate(zip(self.probes.outputs, outputs, strict=True)):
            parts = [np.ravel(segment[-1]) for segment in self.probes.outputs[probe]]
            yield f"output {i}", output, np.concatenate(parts)
        yield from self._learning_pairs()

    def _learning_pairs(self) -> Iterator[tuple[str, Any, Any]]:
        learning = self._native._learning
        if learning is None:
            return
        for synapse, trace in self.synapses.traces.items():
            ours = learning.groups[self._groups[synapse]]
            yield "trace", ours.traces, trace
            yield "learned weights", ours.weights, np.concatenate(synapse.weights)
        yield "random stream", learning._rng.get_state()[1], self.rng.get_state()[1]
        yield "place in random stream", learning._rng.get_state()[2], self.rng.get_state()[2]


def image_of(model: Any) -> ChipImage:
    """Return the image of a discretised model, one block a core."""
    blocks, probes = tuple(model.blocks), tuple(model.probes)
    entries = tuple(BlockEntry("ensemble", f"block {i}") for i in range(len(blocks)))
    spikes = Encoding("spikes")
    pairs = enumerate(model.inputs)
    inputs = tuple(InputEntry(f"input {i}", one.n_neurons, spikes) for i, one in pairs)
    outputs = tuple(OutputName(f"output {i}", None) for i in range(len(probes)))
    floats = FloatBlocks(model, blocks, entries, inputs, outputs)
    return extract(IntegerBlocks(floats, blocks, probes, ()), "none")


def install() -> None:
    """Replace nengo-loihi's emulator by the one that also runs the native backend."""
    nengo_loihi.emulator.EmulatorInterface = ShadowEmulator
    nengo_loihi.simulator.EmulatorInterface = ShadowEmulator


def _sources(spikes: Any) -> np.ndarray:
    return np.asarray(spikes, dtype=int).reshape(-1)
