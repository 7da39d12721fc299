"""The ensemble that a group of parts of other ensembles becomes."""

from typing import Any

import nengo
import numpy as np
import scipy.sparse as sparse

from spikeport.compile.names import Names
from spikeport.compile.rewriting.partition import Partition
from spikeport.compile.rewriting.solved import Solved
from spikeport.compile.rewriting.wires import Wires

ENOUGH = 1e3
"""A current at which every neuron fires."""


class Members:
    """Puts what was built of members together.

    Parameters
    ----------
    partition : Partition
        The groups.
    solved : Solved
        Gains, biases and encoders of their members.
    names : Names
        Their names.
    """

    def __init__(self, partition: Partition, solved: Solved, names: Names) -> None:
        self._partition = partition
        self._solved = solved
        self._names = names

    def ensemble(self, number: int, constants: Wires) -> nengo.Ensemble:
        """Make the ensemble of a group; what is constant of its input becomes bias."""
        radius = self._partition.radius(number)
        gain, bias = self._joined(number, "gain"), self._joined(number, "bias")
        encoders = self._encoders(number)
        for way, matrix in constants.items():
            drive = matrix @ way.source.obj.output
            current = drive if way.target.kind == "neurons" else encoders @ drive / radius
            bias = bias + gain * current
        return nengo.Ensemble(
            len(gain),
            encoders.shape[1],
            radius=radius,
            gain=gain,
            bias=bias,
            encoders=encoders,
            normalize_encoders=False,
            eval_points=_firing_point(gain, bias, encoders, radius),
            neuron_type=self._neuron_type(number),
            label=self._label(number),
        )

    def _joined(self, number: int, name: str) -> np.ndarray:
        parts = self._partition.groups[number]
        built = [getattr(self._solved.ensemble(part.ensemble), name) for part in parts]
        return np.concatenate([b[p.start : p.stop] for b, p in zip(built, parts, strict=True)])

    def _encoders(self, number: int) -> np.ndarray:
        """(n, d) each member has dimensions of its own."""
        parts = self._partition.groups[number]
        built = [self._solved.ensemble(part.ensemble).encoders for part in parts]
        blocks = [b[p.start : p.stop] for b, p in zip(built, parts, strict=True)]
        return sparse.block_diag(blocks).toarray()

    def _neuron_type(self, number: int) -> nengo.neurons.NeuronType:
        """The members' type; neurons start where the members' would have started."""
        parts = self._partition.groups[number]
        states = [self._solved.initial_state(part.ensemble) for part in parts]
        pairs = list(zip(states, parts, strict=True))
        start = {
            name: np.concatenate([s[name][p.start : p.stop] for s, p in pairs])
            for name in states[0]
        }
        kind = parts[0].ensemble.neuron_type
        copy: Any = object.__new__(type(kind))
        copy.__setstate__({**kind.__getstate__(), "initial_state": start})
        return copy

    def _label(self, number: int) -> str:
        parts = self._partition.groups[number]
        first, last = (self._names[part.ensemble] for part in (parts[0], parts[-1]))
        if len(parts) > 1:
            return f"{first} .. {last}"
        groups = [place.group for place in self._partition.places[parts[0].ensemble]]
        return first if len(groups) == 1 else f"{first}[{groups.index(number) + 1}/{len(groups)}]"


def _firing_point(
    gain: np.ndarray, bias: np.ndarray, encoders: np.ndarray, radius: float
) -> np.ndarray:
    """(1, d) a value at which some neuron fires: nengo-loihi wants one wherever it decodes."""
    length = np.linalg.norm(encoders, axis=1)
    best = int(np.argmax(gain * length))
    if gain[best] * length[best] == 0:
        return np.zeros((1, encoders.shape[1]))
    value = (ENOUGH - bias[best]) / (gain[best] * length[best])
    return (encoders[best] / length[best] * value * radius)[np.newaxis]
