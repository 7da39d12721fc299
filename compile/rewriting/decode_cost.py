"""What each way to wire a decoded connection takes, adds and loses.

direct    neuron to neuron, W = E T D
onoff     over one pair of decode neurons for each dimension
preset10  over ten pairs of different thresholds
host      over the host, which decodes and encodes
"""

import functools
from typing import NamedTuple

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo_loihi.neurons import LoihiSpikingRectifiedLinear

from spikeport.compile.numpy1 import numpy1_semantics
from spikeport.compile.rewriting.relay import RELAYS
from spikeport.hardware_models.chip import Limits

WEIGHT_BITS = 9
"""Bits of a synapse: an 8-bit weight, and its share of the headers of lists."""
DECODE_TAU_S = 0.005
"""nengo-loihi's filter behind decode neurons and inputs."""
LEVELS = 255
"""Steps of a weight, relative to the largest of its block."""
N_STEPS = 400


class PathCost(NamedTuple):
    """One way to wire a connection.

    Attributes
    ----------
    path : str
        Its name.
    cores : float
        Share of a core's scarcest resource that it takes, by estimate; may be above 1.
    synaptic_ops_per_s : float
        Synaptic operations at the stated firing rate.
    host_messages_per_s : float
        Spikes and values that go between chip and host.
    delay_s : float
        Delay it adds to the connection's own synapse.
    error : float
        Relative rms error: rounding of weights, and of thresholds where weights are large, and
        noise of a relay behind a 5 ms filter.
    """

    path: str
    cores: float
    synaptic_ops_per_s: float
    host_messages_per_s: float
    delay_s: float
    error: float

    def dominates(self, other: "PathCost") -> bool:
        """No worse in anything, and better in something."""
        pairs = list(zip(self[1:], other[1:], strict=True))
        return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)


class Link(NamedTuple):
    """A decoded connection: ``decoders`` (d, n_pre) and ``encoders`` (n_post, d).

    ``jumps`` (n_post,) are the thresholds that a neuron's voltage rises by at a spike of weight 1.
    """

    decoders: sparse.csr_array
    encoders: sparse.csr_array
    jumps: np.ndarray


def path_costs(link: Link, limits: Limits, dt_s: float, rate_hz: float) -> list[PathCost]:
    """The cost of every path.

    Parameters
    ----------
    link : Link
        The connection.
    limits : Limits
        What a core has.
    dt_s : float
        The time step, in seconds.
    rate_hz : float
        The firing rate of its neurons, as stated.
    """
    relays = [_relay(path, link, limits, dt_s, rate_hz) for path in RELAYS]
    return [_direct(link, limits, rate_hz), *relays, _host(link, limits, dt_s, rate_hz)]


def pareto(costs: list[PathCost]) -> list[PathCost]:
    """Those that no other is better than in everything."""
    return [one for one in costs if not any(other.dominates(one) for other in costs)]


def _direct(link: Link, limits: Limits, rate_hz: float) -> PathCost:
    """Neurons whose decoders are equal share an axon."""
    axons = _distinct(link.decoders)
    full = sparse.csr_array(link.encoders @ axons)
    ops = rate_hz * sparse.csr_array(link.encoders @ link.decoders).nnz
    cores = _cores(limits, in_axons=axons.shape[1], synapse_bits=WEIGHT_BITS * full.nnz)
    return PathCost(
        "direct", cores, ops, 0.0, 0.0, float(np.hypot(rounding(full), _coarseness(link, full)))
    )


def _coarseness(link: Link, weights: sparse.csr_array) -> float:
    """Relative rms error of the threshold: a spike that passes many leaves few steps for each."""
    largest = abs(weights).max(axis=1).toarray().ravel() if weights.nnz else np.zeros(1)
    return float((largest * link.jumps).max() / LEVELS / np.sqrt(12))


def _relay(path: str, link: Link, limits: Limits, dt_s: float, rate_hz: float) -> PathCost:
    neurons = RELAYS[path](dt=dt_s)
    pairs = neurons.pairs_per_dim
    axons, d = _distinct(link.decoders), link.decoders.shape[0]
    bits = 2 * (pairs * axons.nnz + link.encoders.nnz) * WEIGHT_BITS
    ops = 2 * pairs * rate_hz * link.decoders.nnz + _relay_rate(path, dt_s) * link.encoders.nnz
    return PathCost(
        path,
        _cores(
            limits,
            compartments=2 * pairs * d,
            in_axons=axons.shape[1] + 2 * d,
            synapse_bits=bits,
        ),
        ops,
        0.0,
        DECODE_TAU_S + dt_s,
        float(np.hypot(rounding(link.decoders), relay_noise(path, dt_s))),
    )


def _host(link: Link, limits: Limits, dt_s: float, rate_hz: float) -> PathCost:
    d = link.decoders.shape[0]
    ops = 2 * rate_hz * link.decoders.nnz + link.encoders.nnz / dt_s
    bits = 2 * (link.decoders.nnz + link.encoders.nnz) * WEIGHT_BITS
    cores = _cores(
        limits,
        compartments=2 * d,
        in_axons=link.decoders.shape[1] + 2 * d,
        synapse_bits=bits,
    )
    error = float(np.hypot(rounding(link.decoders), relay_noise("host", dt_s)))
    # In every step each dimension is read, and one of its two neurons on the host spikes.
    return PathCost("host", cores, ops, 2 * d / dt_s, DECODE_TAU_S + 2 * dt_s, error)


def _cores(limits: Limits, **used: float) -> float:
    return max(amount / limits.most(resource) for resource, amount in used.items())


def _distinct(decoders: sparse.csr_array) -> sparse.csr_array:
    """The different columns that are not zero."""
    columns = np.unique(decoders.toarray(), axis=1)
    return sparse.csr_array(columns[:, np.any(columns, axis=0)])


def rounding(weights: sparse.csr_array) -> float:
    """Relative rms error of weights in steps of their largest / 255."""
    if weights.nnz == 0:
        return 0.0
    step = np.abs(weights.data).max() / LEVELS
    error = np.round(weights.data / step) * step - weights.data
    return float(np.linalg.norm(error) / np.linalg.norm(weights.data))


def _relay_rate(path: str, dt_s: float) -> float:
    """Spikes per second of all decode neurons of a dimension at rest."""
    neurons = RELAYS[path](dt=dt_s)
    with numpy1_semantics():
        rates = neurons.neuron_type.rates(np.zeros(1), neurons.gain, neurons.bias, dt=dt_s)
    return float(np.sum(rates))


@functools.cache
def relay_noise(path: str, dt_s: float) -> float:
    """Rms error of constant values in [-0.9, 0.9] over a relay and a 5 ms filter, simulated."""
    values = np.linspace(-0.9, 0.9, 37)[:, np.newaxis]
    if path == "host":
        gain = bias = np.full(2, 0.5 / dt_s)
        kind: nengo.neurons.NeuronType = nengo.SpikingRectifiedLinear()
        scale = 1.0
    else:
        neurons = RELAYS[path](dt=dt_s)
        gain, bias, scale = neurons.gain, neurons.bias, neurons.scale
        kind = LoihiSpikingRectifiedLinear()
    signs = np.where(np.arange(len(gain)) % 2, -1.0, 1.0)
    current = gain * signs * values + bias
    voltage, output = np.zeros_like(current), np.zeros_like(current)
    filtered, errors = np.zeros(len(values)), []
    for _ in range(N_STEPS):
        kind.step(dt_s, current, output, voltage)
        decoded = scale * dt_s * (output @ signs)
        filtered += (decoded - filtered) * -np.expm1(-dt_s / DECODE_TAU_S)
        errors.append(filtered - values[:, 0])
    return float(np.sqrt(np.mean(np.square(errors[N_STEPS // 2 :]))))
