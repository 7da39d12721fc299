"""Nengo's host side in lock-step with a chip.

One step, in nengo-loihi's order: the host computes its step from what the chip put out in the
previous one; its on/off neurons' spikes go to the chip, arriving there one step later; the chip
steps; what its outputs hold is decoded and waits for the host's next step.
"""

import inspect
from dataclasses import dataclass
from typing import Any

import nengo
import numpy as np
from nengo.builder.processes import SimProcess
from nengo_loihi.builder import Model

from spikeport.backends.chip import Chip
from spikeport.compile.image import ChipImage
from spikeport.compile.pipeline import Compilation
from spikeport.hardware_models.activity import Activity


@dataclass(frozen=True)
class HostProgram:
    """What stays on the host when a network is compiled.

    ``model`` is Nengo's built model. ``senders`` are the processes that collect the spikes of each
    input, ``error_senders`` those that collect learning errors with the synapse group they go to,
    ``receivers`` those that take the values of outputs, by number; ``probes`` maps probes of
    on-chip objects to the output they record and ``filters`` to their synapses.
    """

    model: nengo.builder.Model
    senders: tuple[Any, ...]
    error_senders: tuple[tuple[Any, int], ...]
    receivers: tuple[tuple[int, Any], ...]
    probes: dict[nengo.Probe, int]


def host_program(model: Model) -> HostProgram:
    """Collect the host side of a model that nengo-loihi has built."""
    outputs = {id(probe): i for i, probe in enumerate(model.probes)}
    sender_of = {id(model.spike_targets[r]): s for s, r in model.host2chip_senders.items()}
    groups = {s: i for i, s in enumerate(s for block in model.blocks for s in block.synapses)}
    on_chip = [p for p in model.nengo_probes if p not in model.chip2host_params]
    return HostProgram(
        model=model.host,
        senders=tuple(sender_of[id(source)].output for source in model.inputs),
        error_senders=tuple(
            (sender.output, groups[_learning_synapse(model, target)])
            for sender, target in model.host2chip_pes_senders.items()
        ),
        receivers=tuple(
            (outputs[id(model.objs[probe]["out"])], node.output)
            for probe, node in model.chip2host_receivers.items()
        ),
        probes={probe: outputs[id(model.objs[probe]["out"])] for probe in on_chip},
    )


def _learning_synapse(model: Model, target: Any) -> Any:
    connection = model.nengo_probe_conns[target.error_target]
    return model.objs[connection]["decoders"]


class HostLoop:
    """A compiled network in execution: Nengo on the host, an image on a chip.

    Implements `spikeport.backends.execution.Execution`.

    Parameters
    ----------
    compilation : Compilation
        The compiled network.
    chip : Chip
        Where its image is loaded.
    seed : int
        Seed of processes on the host.
    """

    def __init__(self, compilation: Compilation, chip: Chip, seed: int) -> None:
        image, program = compilation.image, host_program(compilation.model)
        self.compilation = compilation
        self._chip = chip
        self._program = program
        self._outputs = [Output(image, i) for i in range(len(image.manifest["outputs"]))]
        self._dt_s = image.manifest["dt_s"]
        self._host = nengo.Simulator(
            None, dt=self._dt_s, model=program.model, seed=seed, progress_bar=False, optimize=False
        )
        steps = _process_steps(self._host)
        self._spike_queues = [steps[id(process)].queue for process in program.senders]
        self._error_queues = [
            (group, steps[id(process)].queue) for process, group in program.error_senders
        ]
        self._receivers = [(output, steps[id(process)]) for output, process in program.receivers]
        self._recordings: dict[nengo.Probe, list[np.ndarray]] = {p: [] for p in program.probes}
        self._filters = {
            p: _filter(p, self._outputs[i], self._dt_s) for p, i in program.probes.items()
        }

    def step(self) -> None:
        """Advance host and chip by one step."""
        self._host.step()
        raw = self._chip.step(
            [_take(queue).nonzero()[0] for queue in self._spike_queues],
            self._take_errors(),
        )
        values = [output.decode(held) for output, held in zip(self._outputs, raw, strict=True)]
        next_time = (self._host.n_steps + 1) * self._dt_s
        for output, receiver in self._receivers:
            receiver.receive(next_time, values[output])
        for probe, output in self._program.probes.items():
            filtered = self._filters[probe](self._host.time, values[output])
            self._recordings[probe].append(np.array(filtered))  # a filter reuses its array

    def _take_errors(self) -> dict[int, np.ndarray]:
        errors: dict[int, np.ndarray] = {}
        for group, queue in self._error_queues:
            errors[group] = errors.get(group, 0) + _take(queue)
        return errors

    def data(self, probe: nengo.Probe) -> np.ndarray:
        """(n_steps, size) what a probe recorded."""
        if probe in self._recordings:
            return np.array(self._recordings[probe])
        return np.asarray(self._host.data[probe])

    def activity(self) -> Activity:
        """Exact counts of the chip."""
        return self._chip.activity()

    def close(self) -> None:
        """Free host and chip."""
        self._host.close()
        self._chip.close()


class Output:
    """Decodes one output of an image: weights, then order."""

    def __init__(self, image: ChipImage, i: int) -> None:
        entry = image.manifest["outputs"][i]
        weights = image["output_weights"][image.part("output_weight_start", i)]
        self._weights: Any = {
            "matrix": lambda: weights.reshape(entry["shape"]),
            "scale": lambda: weights[0],
            "none": lambda: None,
        }[entry["weights"]]()
        self._order = entry["order"]
        ends = np.cumsum(entry["segments"])
        self._segments = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        self._is_matrix = entry["weights"] == "matrix"
        self.size = entry["shape"][1] if self._is_matrix else int(ends[-1])

    def decode(self, raw: np.ndarray) -> np.ndarray:
        """(size,) the value of the output."""
        if self._is_matrix:
            # Segment by segment, as matrices of one row: nengo-loihi's calls, hence its rounding.
            rows = raw.reshape(1, -1)
            return sum(rows[:, s].dot(self._weights[s]) for s in self._segments)[0]
        value = raw if self._weights is None else raw.dot(self._weights)
        return value if self._order is None else value[self._order]


def _take(queue: list[tuple[float, np.ndarray]]) -> np.ndarray:
    value = queue[-1][1]
    queue.clear()
    return value


def _process_steps(sim: nengo.Simulator) -> dict[int, Any]:
    """The step function of each process of a simulator, which holds the process's queue.

    Nengo keeps it in the closure of the operator's step and gives no other access.
    """
    return {
        id(op.process): inspect.getclosurevars(step).nonlocals["step_f"]
        for op, step in zip(sim._step_order, sim._steps, strict=True)
        if isinstance(op, SimProcess)
    }


def _filter(probe: nengo.Probe, output: Output, dt_s: float) -> Any:
    if probe.synapse is None:
        return lambda _t, x: x
    shape = (output.size,)
    state = probe.synapse.make_state(shape, shape, dt_s, dtype=np.float32)
    return probe.synapse.make_step(shape, shape, dt_s, rng=None, state=state)
