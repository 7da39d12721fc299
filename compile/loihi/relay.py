"""Decode neurons, connection by connection: nengo-loihi has one kind of them for a whole model.

Decode neurons stand between a decoded connection and its target. The weights from them into a
target depend on their kind, so a target has one group of such synapses for every kind in use.
"""

import contextlib
from collections.abc import Iterator

import nengo
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset10DecodeNeurons

RELAYS = {"onoff": OnOffDecodeNeurons, "preset10": Preset10DecodeNeurons}
ENCODERS = "decode_neuron_encoders"
"""nengo-loihi's name for the synapses from decode neurons."""


@contextlib.contextmanager
def relayed(model: Model, connection: nengo.Connection, path: str) -> Iterator[None]:
    """Build a connection with decode neurons of one kind, ``"onoff"`` or ``"preset10"``."""
    # The builder puts all synapses from decode neurons under one name, and adds to a group that it
    # finds there: only the group of this kind may bear the name while it builds.
    usual = model.decode_neurons
    block = model.objs[connection.post_obj].get("in")
    named = block.named_synapses if isinstance(block, LoihiBlock) else {}
    others, mine = named.pop(ENCODERS, None), named.pop(f"{ENCODERS} {path}", None)
    if mine is not None:
        named[ENCODERS] = mine
    model.decode_neurons = RELAYS[path](dt=model.dt)
    try:
        yield
    finally:
        model.decode_neurons = usual
        # Back under a name of its own, which the next connection of this kind looks for.
        if ENCODERS in named:
            named[f"{ENCODERS} {path}"] = named.pop(ENCODERS)
        if others is not None:
            named[ENCODERS] = others
