"""Learning connections that are torn: nengo-loihi splits blocks that are too large for a core.

The parts of a group of synapses that it splits do not learn any more, and the error that the host
sends has no group to go to.
"""

from collections.abc import Iterator

import nengo

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.loihi.blocks import FloatBlocks


def split_learning(floats: FloatBlocks) -> Iterator[Violation]:
    """Yield a violation of SP012 for each connection whose learning weights were split."""
    whole = {synapse for block in floats.blocks for synapse in block.synapses}
    model = floats.model
    for connection, parts in model.objs.items():
        if not isinstance(connection, nengo.Connection) or "decoders" not in parts:
            continue
        if parts["decoders"].learning and parts["decoders"] not in whole:
            n, pieces = parts["decoders"].n_axons, len(parts["decoded"])
            values = sum(piece.n_neurons for piece in parts["decoded"]) // 2
            used = f"{n:,} neurons decode {values:,} values, on {pieces} cores"
            yield rules.get("SP012").broken(model.names[connection], used)
