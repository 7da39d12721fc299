"""`ConstantInputs`: constant inputs from the host become biases."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import nengo
import numpy as np

from spikeport.compile.ground.names import Named, base
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.rewriting.colouring import regroupable
from spikeport.compile.rewriting.partition import Partition, in_parts
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.compile.rewriting.regroup import regroup


@dataclass(frozen=True)
class ConstantInputs(NetworkPass):
    """Turn inputs that never change, from nodes with a constant output, into biases.

        bias <- bias + gain e . T c / radius

    for a constant c behind a transform T, at encoders e. The decoders are those of the
    original ensemble. Passthrough nodes on the way are multiplied out; functions of a constant stay
    inputs, and so do constants that the host adds to other values for the same dimension, or behind
    filters other than `Lowpass`, `Alpha` and `Triangle`, which may not let constants through.

    A bias acts from the first step. The first steps therefore differ where a connection has a
    synapse, and on the chip, which filters all values from the host for 5 ms. Later steps are the
    same, but a constant beyond the radius, or for neurons beyond 1, where the host would cut it
    off, counts in full.

    Attributes
    ----------
    filtered : bool
        Convert constants behind a synapse, too.
    """

    name: ClassVar[str] = "constant_inputs"
    precedes: ClassVar[tuple[str, ...]] = ("fuse", "decode_path")
    filtered: bool = True

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Rewrite the ensembles that have constant input, and their connections, with matrices."""
        scope = rewrite.scope
        folded = foldable(scope)
        reached = set(_reached(rewrite.network, folded))
        targets = [e for e in regroupable(scope, folded) if e in reached]
        context.note("targets", [rewrite.names[e] for e in targets])
        if not targets:
            return rewrite
        # A group for each ensemble: nothing is fused.
        groups = [part for e in targets for part in in_parts([e], math.inf)]
        return regroup(
            rewrite, Partition(groups), folded, context.dt_s, filtered_constants=self.filtered
        )


def _reached(network: nengo.Network, folded: Sequence[nengo.Node]) -> Iterator[Named]:
    """Yield the objects that constants reach, directly or through passthrough nodes."""
    followers: dict[Named, list[nengo.Connection]] = defaultdict(list)
    for connection in network.all_connections:
        if connection.function is None:
            followers[base(connection.pre_obj)].append(connection)
    constant = [node for node in network.all_nodes if isinstance(node.output, np.ndarray)]
    ahead: list[Named] = [*constant]
    passed, reached = set(folded), set(constant)
    while ahead:
        for connection in followers[ahead.pop()]:
            post = base(connection.post_obj)
            if post not in reached:
                reached.add(post)
                yield post
                ahead += [post] if post in passed else []
