"""The cost of each path of a decoded connection, and the choice of one.

direct    neuron to neuron, W = E T D
onoff     over one pair of decode neurons for each dimension
preset10  over ten pairs of different thresholds
host      over the host, which decodes and encodes
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo_loihi.neurons import LoihiSpikingRectifiedLinear

from spikeport.compile.ground.filters import DECODE_TAU_S
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.loihi.relay import RELAYS
from spikeport.compile.rewriting.links import Link
from spikeport.hardware_models.chip import Limits

SYNAPSE_BITS = 9
"""Bits of a synapse: an 8-bit weight, and its share of the headers of lists."""
LEVELS = 127
"""Steps from zero to the largest weight of a block: 7 bits, and the sign."""
N_STEPS = 400
"""Simulated steps of a relay, of which the second half counts."""
EPSILON_S = 1e-9
"""Difference below which delays are equal: they are sums of time steps and time constants."""
OTHER_FILTER = "its target has one filter for all inputs, of another time constant"
CROWDED = "the spikes into its target take more input axons than a core has"


class PathCost(NamedTuple):
    """The cost of wiring a connection along one path.

    Attributes
    ----------
    path : str
        The name of the path.
    cores : float
        Estimated share of a core's scarcest resource that the path takes; may be above 1.
    synaptic_ops_per_s : float
        Synaptic operations at the stated firing rate.
    host_messages_per_s : float
        Spikes and values that go between chip and host.
    delay_s : float
        Delay that the path adds to the connection's own synapse.
    error : float
        Relative rms error: rounding of weights and thresholds as the chip stores them, or noise of
        a relay behind a 5 ms filter.
    """

    path: str
    cores: float
    synaptic_ops_per_s: float
    host_messages_per_s: float
    delay_s: float
    error: float

    def dominates(self, other: "PathCost") -> bool:
        """Return whether a path is no worse in any cost, and better in at least one."""
        pairs = list(zip(self[1:], other[1:], strict=True))
        return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)


def path_costs(
    link: Link, error: float, limits: Limits, dt_s: float, rate_hz: float
) -> list[PathCost]:
    """Estimate the cost of every path.

    Parameters
    ----------
    link : Link
        The connection.
    error : float
        The error of direct wiring, see `spikeport.compile.rewriting.direct_errors`.
    limits : Limits
        The limits of a core.
    dt_s : float
        The time step, in seconds.
    rate_hz : float
        The firing rate of its neurons, in spikes per second.
    """
    relays = [_relay(path, link, limits, dt_s, rate_hz) for path in RELAYS]
    return [_direct(link, error, limits, rate_hz), *relays, _host(link, limits, dt_s, rate_hz)]


def pareto(costs: list[PathCost]) -> list[PathCost]:
    """Return the costs that no other dominates."""
    return [one for one in costs if not any(other.dominates(one) for other in costs)]


def _direct(link: Link, error: float, limits: Limits, rate_hz: float) -> PathCost:
    bits = SYNAPSE_BITS * link.distinct_weights.nnz
    cores = _cores(limits, in_axons=link.axons.shape[1], synapse_bits=bits)
    return PathCost("direct", cores, rate_hz * link.n_weights, 0.0, 0.0, error)


def _relay(path: str, link: Link, limits: Limits, dt_s: float, rate_hz: float) -> PathCost:
    neurons = RELAYS[path](dt=dt_s)
    pairs = neurons.pairs_per_dim
    axons, d = link.axons, link.decoders.shape[0]
    # A pair of decode neurons has one for positive and one for negative values.
    bits = 2 * (pairs * axons.nnz + link.encoders.nnz) * SYNAPSE_BITS
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
    # The host's two neurons average one spike a step, whatever the value.
    ops = 2 * rate_hz * link.decoders.nnz + link.encoders.nnz / dt_s
    bits = 2 * (link.decoders.nnz + link.encoders.nnz) * SYNAPSE_BITS
    cores = _cores(
        limits,
        compartments=2 * d,
        in_axons=link.decoders.shape[1] + 2 * d,
        synapse_bits=bits,
    )
    error = float(np.hypot(rounding(link.decoders), relay_noise("host", dt_s)))
    # In every step each dimension is read, and its two host neurons average one spike.
    return PathCost("host", cores, ops, 2 * d / dt_s, DECODE_TAU_S + 2 * dt_s, error)


def _cores(limits: Limits, **used: float) -> float:
    return max(amount / limits.most(resource) for resource, amount in used.items())


def rounding(weights: sparse.csr_array) -> float:
    """Return the relative rms error of weights, rounded to steps of 1/127 of the largest."""
    if weights.nnz == 0:
        return 0.0
    step = np.abs(weights.data).max() / LEVELS
    error = np.round(weights.data / step) * step - weights.data
    return float(np.linalg.norm(error) / np.linalg.norm(weights.data))


def _relay_rate(path: str, dt_s: float) -> float:
    """Return the spikes per second of all decode neurons of a dimension whose value is zero."""
    neurons = RELAYS[path](dt=dt_s)
    with numpy1_semantics():
        rates = neurons.neuron_type.rates(np.zeros(1), neurons.gain, neurons.bias, dt=dt_s)
    return float(np.sum(rates))


@functools.cache
def relay_noise(path: str, dt_s: float) -> float:
    """Simulate a relay and a 5 ms filter; return the rms error of values in [-0.9, 0.9]."""
    # Values stop short of the range's ends, where a relay saturates.
    values = np.linspace(-0.9, 0.9, 37)[:, np.newaxis]
    if path == "host":
        gain = bias = np.full(2, 0.5 / dt_s)
        kind: nengo.neurons.NeuronType = nengo.SpikingRectifiedLinear()
        scale = 1.0
    else:
        neurons = RELAYS[path](dt=dt_s)
        gain, bias, scale = neurons.gain, neurons.bias, neurons.scale
        kind = LoihiSpikingRectifiedLinear()
    # Decode neurons come in pairs: on, off, on, off.
    signs = np.where(np.arange(len(gain)) % 2, -1.0, 1.0)
    current = gain * signs * values + bias
    voltage, output = np.zeros_like(current), np.zeros_like(current)
    filtered, errors = np.zeros(len(values)), []
    for _ in range(N_STEPS):
        kind.step(dt_s, current, output, voltage)
        decoded = scale * dt_s * (output @ signs)
        filtered += (decoded - filtered) * -np.expm1(-dt_s / DECODE_TAU_S)
        errors.append(filtered - values[:, 0])
    # In the first half the filter still fills.
    return float(np.sqrt(np.mean(np.square(errors[N_STEPS // 2 :]))))


@dataclass(frozen=True)
class Slack:
    """The price that a lower error may have.

    Attributes
    ----------
    cores : float
        Cores that a path may take beyond the fewest.
    delay_s : float
        Delay that a path may add beyond the delay of decode neurons, in seconds.
    """

    cores: float
    delay_s: float


def rejected(costs: Sequence[PathCost], slack: Slack, not_direct: str = "") -> dict[str, str]:
    """Return every path but the best, each with the reason why it is rejected.

    The best path loses least among those that are not too slow and do not take too many cores.

    Parameters
    ----------
    costs : sequence of PathCost
        The costs of all paths.
    slack : Slack
        The price that a lower error may have.
    not_direct : str
        The reason why the connection cannot be wired directly; empty if it can.
    """
    reasons = {"direct": not_direct} if not_direct else {}
    relay_s = min(one.delay_s for one in costs if one.path in RELAYS)
    for one in costs:
        if (more_s := one.delay_s - relay_s) > slack.delay_s + EPSILON_S:
            reasons[one.path] = f"{1000 * more_s:g} ms slower than decode neurons"
    # Paths that are too slow do not count for the fewest cores.
    fewest = min(one.cores for one in costs if one.path not in reasons)
    for one in costs:
        if one.cores > fewest + slack.cores:
            reasons.setdefault(one.path, f"{one.cores - fewest:.2g} more cores than the fewest")
    left = [one for one in costs if one.path not in reasons]
    best = min(left, key=lambda one: one.error)
    lost = f"has a larger error than {best.path}"
    return reasons | {one.path: lost for one in left if one is not best}


def all_but(path: str, costs: Sequence[PathCost]) -> dict[str, str]:
    """Return every path but the one that is set, each with this setting as the reason."""
    return {one.path: f"{path} is set" for one in costs if one.path != path}


def chosen(costs: Sequence[PathCost], reasons: dict[str, str]) -> str:
    """Return the path that is not rejected."""
    return next(one.path for one in costs if one.path not in reasons)
