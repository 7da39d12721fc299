"""`SplitEnsembles`: ensembles that are too large to be decoded at once are cut."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import nengo
from nengo.ensemble import Neurons
from pydantic import Field

from spikeport.compile.ground.names import base
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import neurons_read
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.rewriting.colouring import regroupable
from spikeport.compile.rewriting.partition import Part, Partition, in_parts
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.compile.rewriting.regroup import regroup


@dataclass(frozen=True)
class SplitEnsembles(NetworkPass):
    """Cut ensembles with more neurons than a relay or read-out has input axons.

    The decoders are those of the whole ensemble. A probe of its decoded value reads a sum made on
    the host, one step later. An ensemble stays as it is if a probe reads neurons of several parts.

    Attributes
    ----------
    max_neurons : int, optional
        The most neurons of an ensemble; by default the number of input axons of a core.
    """

    name: ClassVar[str] = "split_ensembles"
    precedes: ClassVar[tuple[str, ...]] = ("fuse", "decode_path")
    max_neurons: Annotated[int, Field(ge=1)] | None = None

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Cut the ensembles, and rewrite their connections with matrices."""
        most = self.max_neurons or context.chip.limits.most("in_axons")
        scope = rewrite.scope
        folded = foldable(scope)
        large = [m for m in regroupable(scope, folded) if m.n_neurons > most]
        parts = {m: [part for (part,) in in_parts([m], most)] for m in large}
        # A probe records one object, and no object has neurons of several parts.
        for probe in rewrite.network.all_probes:
            if isinstance(probe.obj, Neurons) and not _in_one(probe, parts.get(base(probe.obj))):
                del parts[base(probe.obj)]
        context.note("parts", {rewrite.names[m]: len(cut) for m, cut in parts.items()})
        if not parts:
            return rewrite
        groups = [[part] for cut in parts.values() for part in cut]
        return regroup(rewrite, Partition(groups), folded, context.dt_s)


def _in_one(probe: nengo.Probe, parts: Sequence[Part] | None) -> bool:
    """Return whether a probe reads neurons of one part, or of another ensemble."""
    if parts is None:
        return True
    read = neurons_read(probe)
    return any(part.start <= read.min() and read.max() < part.stop for part in parts)
