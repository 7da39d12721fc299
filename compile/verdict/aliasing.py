"""How far rates on the chip, whose intervals between spikes are whole steps, are from continuous.

    error = rms(chip's rates - neuron type's rates) / rms(neuron type's rates)

over a grid of represented values along each neuron's encoder. nengo-loihi solves decoders for the
chip's rates, so that what is decoded is not off by as much.
"""

import nengo
import numpy as np
from nengo_loihi.neurons import loihi_rates, nengo_rates

from spikeport.compile.build import Blocks

GRID = np.linspace(-1, 1, 101)


def rate_aliasing(blocks: Blocks) -> dict[str, float]:
    """The error of every ensemble on the chip, by the label of its (first) block."""
    return {
        _label(blocks, parts["out"]): _error(ensemble, blocks)
        for ensemble, parts in blocks.model.objs.items()
        if isinstance(ensemble, nengo.Ensemble)
    }


def _label(blocks: Blocks, out: object) -> str:
    first = out[0] if isinstance(out, list) else out
    return blocks.labels[first].split("[1/")[0]


def _error(ensemble: nengo.Ensemble, blocks: Blocks) -> float:
    built = blocks.model.params[ensemble]
    x = np.repeat(GRID[:, np.newaxis], ensemble.n_neurons, axis=1)
    wanted = nengo_rates(ensemble.neuron_type, x, built.gain, built.bias)
    rates = loihi_rates(ensemble.neuron_type, x, built.gain, built.bias, blocks.model.dt)
    norm = np.linalg.norm(wanted)
    return float(np.linalg.norm(rates - wanted) / norm) if norm > 0 else 0.0
