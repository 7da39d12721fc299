"""Nengo's host side in lock-step with a chip.

A step follows nengo-loihi's order. The host computes its step from the chip's outputs of the
previous step. The spikes of its on/off neurons go to the chip, where they arrive one step later.
The chip steps. Its outputs are decoded, and wait for the host's next step.
"""

import functools
import warnings
from dataclasses import replace

import nengo
import numpy as np
from nengo.base import NengoObject

from spikeport.backends.built import BuiltParameters
from spikeport.backends.chip import Chip, Joinable, Joined
from spikeport.backends.decoding import Decoder, OutputRecording
from spikeport.backends.generators import own_generators
from spikeport.backends.host_program import HostProgram
from spikeport.backends.kept import fresh, program_of
from spikeport.backends.lost_spikes import LostSpikes
from spikeport.backends.pooled_signals import PooledSignals
from spikeport.backends.sampling import recorded
from spikeport.backends.tape import Flattener
from spikeport.compile.ground.refusal import without_addresses
from spikeport.compile.ground.rewrite import Built
from spikeport.compile.image.tables import offsets, part
from spikeport.compile.pipeline import Compilation
from spikeport.hardware_models.activity import Activity

CHECKED_STEPS = 20
"""Number of steps from one search for NaN to the next: in the walk, one takes a tenth of a step."""


class HostLoop:
    """A compiled network in execution: Nengo on the host, an image on a chip.

    Implements `spikeport.backends.execution.Execution`.

    Parameters
    ----------
    compilation : Compilation
        The compiled network.
    chip : Chip
        The chip that its image is loaded on.
    seed : int
        Seed of processes on the host.
    """

    def __init__(self, compilation: Compilation, chip: Chip, seed: int) -> None:
        image, program = compilation.image, program_of(compilation)
        self.compilation = compilation
        self._chip = chip
        self._decoder = Decoder(image, [output for output, _ in program.receivers])
        self._recordings = {
            probe: OutputRecording(image, output, probe) for probe, output in program.probes.items()
        }
        with own_generators(program.model):
            self._host = nengo.Simulator(
                None,
                dt=image.manifest.dt_s,
                model=program.model,
                seed=seed,
                progress_bar=False,
                # The optimiser merges signals, which would then lie outside the pool.
                optimize=False,
            )
            self._flatten(program)
        first = offsets(image.inputs.size)
        self._events = [(first[i], one) for i, one in program.events.items()]
        self._n_steps, self._has_nan = 0, False
        self._joined = self._join()

    def _join(self) -> Joined | None:
        """Return the chip's step on the host's memory; None where it has none for this network."""
        if self._events or self._errors or not isinstance(self._chip, Joinable):
            return None
        return self._chip.join(self._sources, self._decoder.table, self._inbox)

    def _flatten(self, program: HostProgram) -> None:
        """Turn the host into a function, and allocate the values it exchanges with the chip."""
        image = self.compilation.image
        errors = sum(port.size for port in program.error_senders)
        size = image.n_inputs + errors + self._decoder.size
        signals = PooledSignals(program.model, extra=size)
        self._memory = signals.memory
        self._sources = signals.allocate(image.n_inputs)
        self._lost = LostSpikes(image, self._sources)
        starts = offsets(image.inputs.size)
        boxes = {id(p.process): self._sources[part(starts, p.target)] for p in program.senders}
        boxes |= {id(port.process): signals.allocate(port.size) for port in program.error_senders}
        learning = np.flatnonzero(image.learns).tolist()
        self._errors = [
            (learning[port.target], boxes[id(port.process)]) for port in program.error_senders
        ]
        self._inbox = signals.allocate(self._decoder.size)
        for (_, process), place in zip(program.receivers, self._decoder.parts, strict=True):
            boxes[id(process)] = self._inbox[place]
        self._step_host = Flattener(self._host, signals, boxes).step()

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the link to a board; see `spikeport.backends.chip.Chip.link`."""
        return self._chip.link

    def step(self) -> None:
        """Advance host and chip by one step."""
        self._step_host()
        self._lost.count()
        self._n_steps += 1
        if self._n_steps % CHECKED_STEPS == 0 and not self._has_nan:
            self._warn_of_nan()
        if self._host.model.probes:
            self._probe()
        held = self._exchange()
        for recording in self._recordings.values():
            recording.append(held)

    def _warn_of_nan(self) -> None:
        """Warn of NaN in a signal, once; Nengo raises FloatingPointError where it arises."""
        if not np.isnan(self._memory).any():
            return
        self._has_nan = True
        signals = self._host.signals.items()
        first = next((s.name for s, values in signals if np.isnan(values).any()), "a value")
        warnings.warn(
            f"{without_addresses(first)}: NaN on the host since step {self._n_steps} or up to "
            f"{CHECKED_STEPS - 1} before; cure: give a loop that grows without bound a gain below "
            "1, or a limit",
            RuntimeWarning,
            stacklevel=4,
        )

    def _probe(self) -> None:
        """Sample the host's probes before the chip steps, as Nengo does at the end of its step."""
        self._host.signals[self._host.model.step][()] = self._n_steps  # which samples are due
        self._host._probe()

    def _exchange(self) -> list[np.ndarray]:
        """Step the chip with the host's spikes and errors; decode and return its outputs' state."""
        decoded = False
        if self._joined is None:
            held = self._chip.step(self._spikes(), self._sum_errors())
        else:
            held, decoded = self._joined()
        if not decoded:
            self._decoder.decode(held, self._inbox)
        return held

    def _spikes(self) -> np.ndarray:
        """Return the sources that spike in this step; sources in event files, once per event."""
        spikes = self._sources.nonzero()[0]
        if not self._events:
            return spikes
        events = [first + one.at(self._n_steps) for first, one in self._events]
        return np.concatenate([spikes, *events])

    def _sum_errors(self) -> dict[int, np.ndarray]:
        errors: dict[int, np.ndarray] = {}
        for group, box in self._errors:
            # Several connections may teach one group: their errors add up.
            errors[group] = errors.get(group, 0) + box
        return errors

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """Return the values that a probe recorded, (n_steps, size)."""
        probe = self.compilation.stand_ins.get(probe, probe)
        if probe in self._recordings:
            return self._recordings[probe].data()
        return recorded(self._host, probe)

    def built(self, obj: NengoObject) -> Built:
        """Return the built parameters; see `spikeport.backends.execution.Execution.built`."""
        return self._built[obj]

    @functools.cached_property
    def _built(self) -> BuiltParameters:
        return BuiltParameters(fresh(self.compilation))

    def clear_probes(self) -> None:
        """Forget the values that probes recorded so far."""
        self._host.clear_probes()
        for recording in self._recordings.values():
            recording.clear()

    def activity(self) -> Activity:
        """Return exact counts of the chip, and of the values that the host could not send."""
        return replace(self._chip.activity(), cut_off=self._lost.by_input())

    def close(self) -> None:
        """Free host and chip."""
        self._host.close()
        self._chip.close()
