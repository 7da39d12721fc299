"""The error of rates on the chip, where intervals between spikes are whole steps.

    error = rms(chip's rates - neuron type's rates) / rms(neuron type's rates)

over a grid of represented values along each neuron's encoder. nengo-loihi solves decoders for the
chip's rates, so that decoded values have a smaller error.
"""

import nengo
import numpy as np
from nengo_loihi.builder import Model
from nengo_loihi.neurons import loihi_rates, nengo_rates

from spikeport.compile.ground.notices import TURN
from spikeport.compile.ground.quantisation import relative_rms
from spikeport.compile.loihi.blocks import FloatBlocks, first_of
from spikeport.compile.loihi.quick_builder import quick_builder

GRID = np.linspace(-1, 1, 101)


def rate_aliasing(floats: FloatBlocks) -> dict[str, float]:
    """Return the error of every ensemble on the chip, by its name."""
    owner = dict(zip(floats.model.blocks, (entry.owner for entry in floats.entries), strict=True))
    pieces: dict[str, list[nengo.Ensemble]] = {}
    for ensemble, parts in floats.model.objs.items():
        if isinstance(ensemble, nengo.Ensemble):
            pieces.setdefault(owner[first_of(parts["out"])], []).append(ensemble)
    return {name: _error(ensembles, floats.model) for name, ensembles in pieces.items()}


def _error(pieces: list[nengo.Ensemble], model: Model) -> float:
    """Return the error of an ensemble, which passes may have cut into pieces."""
    both = [_rates(piece, model) for piece in pieces]
    rates, wanted = (np.concatenate(each, axis=1) for each in zip(*both, strict=True))
    return relative_rms(rates, wanted)


def _rates(ensemble: nengo.Ensemble, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Return rates on the chip and of the neuron type in Hz, (len(GRID), n_neurons) each."""
    built = model.params[ensemble]
    x = np.repeat(GRID[:, np.newaxis], ensemble.n_neurons, axis=1)
    wanted = nengo_rates(ensemble.neuron_type, x, built.gain, built.bias)
    with TURN, quick_builder():
        rates = loihi_rates(ensemble.neuron_type, x, built.gain, built.bias, model.dt)
    return rates, wanted
