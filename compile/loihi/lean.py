"""Direct connections without useless weights and axons: no zeros, one axon for equal weights.

Read-outs of probes that a pass made are treated alike: each reads one ensemble of many that are
fused.

A weight of zero does nothing, and spikes on one axon add up, so results stay the same. This is done
during the build, since nengo-loihi splits blocks at its end, by the axons and weights they have.
"""

import contextlib
from collections.abc import Iterator

import nengo
import numpy as np
from nengo_loihi.block import Axon, LoihiBlock, Synapse
from nengo_loihi.builder import Model

from spikeport.compile.loihi.solver import DENSE_FROM


@contextlib.contextmanager
def lean(model: Model, connection: nengo.Connection) -> Iterator[None]:
    """Build a lean connection to neurons, from neurons or from the host, within the context.

    Each axon has a row of weights of its own, as with matrices; convolutions share rows.
    """
    target = model.objs[connection.post_obj]["in"]
    n_before = len(target.synapses)
    yield
    # An object on the host has no entry, and indexing would create one.
    source = model.objs.get(connection.pre_obj, {}).get("out")
    for synapse in target.synapses[n_before:]:
        _drop_zeros(synapse)
        if isinstance(source, LoihiBlock):
            (axon,) = (one for one in source.axons if one.target is synapse)
            _share(synapse, axon)


def lean_read_out(model: Model, connection: nengo.Connection) -> None:
    """Drop the useless weights and axons of a read-out that is built."""
    parts = model.objs[connection]
    _drop_zeros(parts["decoders"])
    _share(parts["decoders"], parts["decode_axon"])


def _drop_zeros(synapse: Synapse) -> None:
    # A few zeros are cheaper to keep: weights without gaps need no index each. If all weights are
    # zero, they stay as well, since nengo-loihi's discretiser needs at least one.
    n_all = sum(weights.size for weights in synapse.weights)
    n_used = sum(map(np.count_nonzero, synapse.weights))
    if n_used == 0 or n_used > DENSE_FROM * n_all:
        return
    used = [weights[0] != 0 for weights in synapse.weights]
    synapse.indices = [i[:, some] for i, some in zip(synapse.indices, used, strict=True)]
    synapse.weights = [w[:, some] for w, some in zip(synapse.weights, used, strict=True)]


def _share(synapse: Synapse, axon: Axon) -> None:
    parts = zip(synapse.weights, synapse.indices, strict=True)
    keys = [(w.tobytes(), i.tobytes()) for w, i in parts]
    # In reverse, so that the first axon with a key is the one that stays.
    first = {key: n for n, key in reversed(list(enumerate(keys)))}
    kept = sorted(n for n in first.values() if synapse.weights[n].size)
    place = {keys[n]: axon_number for axon_number, n in enumerate(kept)}
    # -1 marks a neuron without an axon: it has no weights left, or never had any.
    used = axon.compartment_map >= 0
    axon.compartment_map[used] = [place.get(keys[i], -1) for i in axon.compartment_map[used]]
    synapse.weights = [synapse.weights[n] for n in kept]
    synapse.indices = [synapse.indices[n] for n in kept]
    synapse.n_axons = axon.n_axons = len(kept)
