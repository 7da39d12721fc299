"""The filter that a connection asks of its target's compartments.

A compartment's current has one decay, whatever its source. Spikes that go straight to neurons are
filtered there, by the connection's own synapse. Values are filtered by a relay or on the host, and
nengo-loihi filters them for another 5 ms in the compartments.
"""

from typing import NamedTuple

import nengo
import numpy as np
from nengo.ensemble import Neurons

from spikeport.compile.ground.scope import full_weights

DECODE_TAU_S = 0.005
"""nengo-loihi's filter behind decode neurons and inputs."""


class Passage(NamedTuple):
    """The filters that a connection passes on the chip.

    Attributes
    ----------
    connection, source, target : str
        The names of the connection and of the ensembles at its ends; "" for a source on the host.
    own_s : float
        The time constant of its synapse, in seconds.
    relay_s : float or None
        The time constant of its relay, None without one.
    target_s : float
        The time constant that the connection asks of its target's compartments.
    """

    connection: str
    source: str
    target: str
    own_s: float
    relay_s: float | None
    target_s: float


def time_constant_s(connection: nengo.Connection) -> float:
    """Return the time constant of the filter of a connection on the chip, 0 without one."""
    return float(getattr(connection.synapse, "tau", 0.0))  # lint refuses all but low-passes there


def delay_s(synapse: nengo.synapses.Synapse | None) -> float | None:
    """Return how late a filter passes slow signals, its group delay in seconds; None if unknown.

    H(s) = n(s) / d(s),    delay = d'(0) / d(0) - n'(0) / n(0)
    """
    if synapse is None:
        return 0.0
    if isinstance(synapse, nengo.Triangle):
        return float(synapse.t / 3)  # the centre of a response that falls to 0 at t
    if not isinstance(synapse, nengo.synapses.LinearFilter) or not synapse.analog:
        return None
    numerator, denominator = np.poly1d(synapse.num), np.poly1d(synapse.den)
    if not (numerator(0) and denominator(0)):
        return None
    return float(denominator.deriv()(0) / denominator(0) - numerator.deriv()(0) / numerator(0))


def keeps_constants(synapse: nengo.synapses.Synapse | None) -> bool:
    """Return whether a filter is known to pass a constant unchanged, once it has settled."""
    return synapse is None or type(synapse) in (nengo.Lowpass, nengo.Alpha, nengo.Triangle)


def sends_spikes(connection: nengo.Connection, from_chip: bool) -> bool:
    """Return whether a connection, as written, sends spikes straight to neurons."""
    if isinstance(connection.post_obj, Neurons):
        return from_chip or isinstance(connection.pre_obj, Neurons)
    return from_chip and full_weights(connection)


def asked_filter_s(connection: nengo.Connection, from_chip: bool) -> float:
    """Return the time constant that a connection asks of its target's compartments, in seconds."""
    return time_constant_s(connection) if sends_spikes(connection, from_chip) else DECODE_TAU_S
