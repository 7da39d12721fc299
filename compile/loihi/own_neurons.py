"""Building and rounding of `spikeport.neurons.IntegrateAndFire`, in the units of the network.

nengo-loihi's builder would clip voltages at zero, and give all currents of a block one decay. Its
discretiser never scales weights above 8 bits times 2^6, so that a large weight leaves the threshold
few bits: here each group of synapses has the exponent that its weights need, as on the chip.

    weight = m 2^(7 + e),   -127 <= m <= 127,   -1 <= e <= 7
"""

import nengo
import numpy as np
from nengo.ensemble import Neurons
from nengo_loihi.block import Compartment, LoihiBlock, Synapse
from nengo_loihi.builder import Builder, Model

from spikeport.compile.ground.refusal import RefusedError
from spikeport.neurons import (
    MANTISSA,
    OWN_TYPES,
    UNIT,
    IntegrateAndFire,
    chip_decays,
    weight_step,
)

COARSEST = 2**14
"""The largest step of weights, whose exponent is 7."""

VOLTAGE = 2**23 - 1
"""The voltage goes from -VOLTAGE to VOLTAGE."""

THRESHOLD = (2**17 - 1) * UNIT
BIAS_MANTISSA, BIAS_EXPONENT = 2**12 - 1, 7


class OwnFilter(Compartment):
    """Compartments that keep the filter of their neurons: connections do not set it."""

    def configure_filter(self, tau_s: float, dt: float = 0.001) -> None:
        """Keep the filter."""

    def configure_default_filter(self, tau_s: float, dt: float = 0.001) -> None:
        """Keep the filter."""


@Builder.register(IntegrateAndFire)  # type: ignore[untyped-decorator]  # nengo-loihi's
def build_integrate_and_fire(
    model: Model, kind: IntegrateAndFire, neurons: Neurons, block: LoihiBlock
) -> None:
    """Configure a block; spikes are 1/dt high, so all values but decays are in units of 1/dt."""
    state = OwnFilter(block.n_neurons, label=block.compartment.label)
    state.decay_u[:], state.decay_v[:] = kind.current_decay, kind.voltage_decay
    state.vth[:] = kind.threshold / model.dt
    state.bias[:] = block.compartment.bias + (kind.leak + kind.correction) / model.dt
    state.refract_delay[:] = 1
    state.vmin, state.scale_u, state.scale_v = -np.inf, False, False
    block.compartment = state


def own_blocks(model: Model) -> set[LoihiBlock]:
    """Return the blocks of our own neurons; nengo-loihi may split an ensemble into several."""
    found: set[LoihiBlock] = set()
    for obj, parts in model.objs.items():
        if isinstance(obj, nengo.Ensemble) and type(obj.neuron_type) in OWN_TYPES:
            blocks = parts["in"]
            found.update(blocks if isinstance(blocks, list) else [blocks])
    return found


def discretise_own(block: LoihiBlock, label: str, dt_s: float) -> float:
    """Round a block of our own neurons in place; return the chip's units in a voltage of 1.

    Raises
    ------
    RefusedError
        If a weight, threshold or leak is beyond what the chip can hold.
    """
    state = block.compartment
    for synapse in block.synapses:
        _round_weights(synapse, label, dt_s)
    current, voltage = chip_decays(state.decay_u, state.decay_v)
    state.decay_u, state.decay_v = _integers(current - 1), _integers(voltage)  # the chip adds 1
    state.vth = _integers(_rounded_thresholds(state.vth * dt_s, label))
    state.bias = _integers(_rounded_biases(state.bias * dt_s, label))
    state.vmin, state.vmax, state.noise_exp = -VOLTAGE, VOLTAGE, 1
    state.discretize_info = {
        "w_exp": 0,
        "w_scale": dt_s / UNIT,
        "v_scale": dt_s,
        "b_scale": dt_s,
    }
    return dt_s


def _round_weights(synapse: Synapse, label: str, dt_s: float) -> None:
    largest = max((np.abs(w).max(initial=0) for w in synapse.weights), default=0) * dt_s
    step = weight_step(largest)
    if step > COARSEST:
        raise _beyond(label, "weight", largest, MANTISSA * COARSEST)
    synapse.format(weight_exp=int(np.log2(step)) - 7)
    synapse.weights = [_integers(np.round(w * (dt_s / step)) * step) for w in synapse.weights]


def _rounded_thresholds(values: np.ndarray, label: str) -> np.ndarray:
    if values.max() > THRESHOLD:
        raise _beyond(label, "threshold", values.max(), THRESHOLD)
    return np.maximum(np.round(values / UNIT), 1) * UNIT


def _rounded_biases(values: np.ndarray, label: str) -> np.ndarray:
    largest = np.abs(values).max()
    if largest > BIAS_MANTISSA << BIAS_EXPONENT:
        raise _beyond(label, "leak", largest, BIAS_MANTISSA << BIAS_EXPONENT)
    # The least power of two with which the mantissa holds the value; 1 for small values.
    step = np.exp2(np.ceil(np.log2(np.maximum(np.abs(values) / BIAS_MANTISSA, 1))))
    rounded: np.ndarray = np.round(values / step) * step
    return rounded


def _beyond(label: str, what: str, used: float, limit: int) -> RefusedError:
    return RefusedError(
        f"{label}: a {what} of {used:,.0f} units, at most {limit:,}; cure: scale down the "
        "thresholds, weights and leaks of its neurons together"
    )


def _integers(values: np.ndarray) -> np.ndarray:
    return np.asarray(values).astype(np.int32)
