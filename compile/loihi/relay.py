"""Decode neurons of a kind for each connection: nengo-loihi has one kind for a whole model.

Decode neurons stand between a decoded connection and its target. Their weights into a target depend
on their kind, so a target has one group of such synapses for every kind in use.

nengo-loihi filters twice: by a connection's synapse on the way into decode neurons, and for 5 ms
behind them. If the filter of the target's compartments is set, the two filters and the step between
them add up to the synapse's delay, as long as this leaves 5 ms for the filter before decode
neurons: unfiltered spikes would drive them beyond their range.

Decode neurons represent values up to the target's radius. If many neurons decode a small value
behind a slow filter, their weights are below the chip's least, and nengo-loihi's discretiser finds
no exponent. Decode neurons then represent the values that occur, and their spikes count for less.
"""

import contextlib
import copy
from collections.abc import Iterator

import nengo
import numpy as np
from nengo.exceptions import BuildError
from nengo_loihi.block import LoihiBlock, Synapse
from nengo_loihi.builder import Model, discretize
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset10DecodeNeurons
from nengo_loihi.neurons import loihi_rates

from spikeport.compile.ground.filters import DECODE_TAU_S, time_constant_s
from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import height_in_rates

RELAYS = {"onoff": OnOffDecodeNeurons, "preset10": Preset10DecodeNeurons}
ENCODERS = "decode_neuron_encoders"
"""nengo-loihi's name for the synapses from decode neurons."""

HEADROOM = 1.25
"""A factor on the largest decoded value, as room for its noise."""


@contextlib.contextmanager
def relayed(
    model: Model, connection: nengo.Connection, path: str, target_s: float | None = None
) -> Iterator[None]:
    """Build a connection with decode neurons of one kind.

    Parameters
    ----------
    model : Model
        nengo-loihi's model.
    connection : nengo.Connection
        The connection.
    path : str
        The kind, ``"onoff"`` or ``"preset10"``.
    target_s : float, optional
        The time constant of the target's compartments, in seconds; by default nengo-loihi's.
    """
    # The builder puts all synapses from decode neurons under one name, and adds to a group that it
    # finds there: only the group of this kind may have the name while it builds.
    usual = model.decode_neurons, model.decode_tau
    block = model.objs[connection.post_obj].get("in")
    named = block.named_synapses if isinstance(block, LoihiBlock) else {}
    others, mine = named.pop(ENCODERS, None), named.pop(f"{ENCODERS} {path}", None)
    if mine is not None:
        named[ENCODERS] = mine
    model.decode_neurons = RELAYS[path](dt=model.dt)
    if target_s is not None:
        own_s = time_constant_s(connection)
        model.decode_tau = min(target_s, max(own_s, DECODE_TAU_S))  # no slower than needed
    try:
        yield
        # Full weights, and spikes to neurons, have no decode neurons.
        if target_s is not None and "decoded" in model.objs[connection]:
            _set_filter(model, connection, target_s)
    finally:
        model.decode_neurons, model.decode_tau = usual
        # Put the group back under its own name, where the next connection of this kind finds it.
        if ENCODERS in named:
            named[f"{ENCODERS} {path}"] = named.pop(ENCODERS)
        if others is not None:
            named[ENCODERS] = others


def _set_filter(model: Model, connection: nengo.Connection, target_s: float) -> None:
    """Let decode neurons filter for the rest that the target leaves of a connection's synapse."""
    compartment = model.objs[connection]["decoded"].compartment
    compartment.tau_s = None  # nengo-loihi would not lower it
    compartment.configure_filter(relay_filter_s(connection, target_s, model.dt), dt=model.dt)


def relay_filter_s(connection: nengo.Connection, target_s: float, dt_s: float) -> float:
    r"""Return the time constant of a relay's compartments, in seconds.

    .. math:: \tau_r = \max(\tau - \tau_t - dt, \min(\tau, 5 ms))
    """
    own_s = time_constant_s(connection)
    return max(own_s - target_s - dt_s, min(own_s, DECODE_TAU_S))


def fit_range(model: Model, connection: nengo.Connection) -> None:
    """Let decode neurons represent only the values that occur, if their weights are too small."""
    parts, source = model.objs.get(connection, {}), base(connection.pre_obj)
    # The values of event files are not known.
    of_neurons = isinstance(source, nengo.Ensemble) and "mid_axon" in parts
    if not of_neurons or connection.learning_rule_type is not None:
        return
    if _has_exponent(parts["decoded"]):
        return
    largest = _largest_value(model, connection)
    if 0 < HEADROOM * largest < 1:
        factor = 1 / (HEADROOM * largest)
        _scale(parts["decoders"], factor)
        _weaken(model, connection, factor)


def _has_exponent(block: LoihiBlock) -> bool:
    """Return whether nengo-loihi's discretiser finds an exponent for a block's weights."""
    largest = max(synapse.max_abs_weight() for synapse in block.synapses)
    try:
        discretize.discretize_compartment(copy.deepcopy(block.compartment), largest)
    except BuildError:
        return False
    return True


def _largest_value(model: Model, connection: nengo.Connection) -> float:
    """Return the largest value that a connection decodes, in units of its target's radius."""
    ensemble = base(connection.pre_obj)
    built, decoded = model.params[ensemble], model.params[connection]
    values = built.eval_points if decoded.eval_points is None else decoded.eval_points
    points = values @ built.encoders.T / ensemble.radius
    kind = ensemble.neuron_type
    rates = loihi_rates(kind, points, built.gain, built.bias, model.dt)
    # A connection from neurons may read only some of them.
    spikes = rates[:, connection.pre_slice] if connection.pre_obj is not ensemble else rates
    weights = decoded.weights * model.dt / height_in_rates(kind)
    return float(np.abs(spikes @ weights.T).max() / connection.post_obj.radius)


def _scale(synapse: Synapse, factor: float) -> None:
    synapse.weights = [weights * np.float32(factor) for weights in synapse.weights]


def _weaken(model: Model, connection: nengo.Connection, factor: float) -> None:
    """Give decode neurons synapses of their own into the target, with smaller weights."""
    axon, target = model.objs[connection]["mid_axon"], model.objs[connection.post_obj]["in"]
    usual: Synapse = axon.target
    axon.target = copy.copy(usual)
    _scale(axon.target, 1 / factor)
    # A group of its own, since the usual one serves the other connections into this target.
    target.add_synapse(axon.target)
    if not any(other.target is usual for block in model.blocks for other in block.axons):
        target.synapses.remove(usual)
        # In place: `relayed` puts the groups that it sets aside back into this table.
        for name in [k for k, v in target.named_synapses.items() if v is usual]:
            del target.named_synapses[name]
