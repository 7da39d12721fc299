"""Small ensembles that are wired alike become large ones."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.rewriting.members import members
from spikeport.compile.rewriting.partition import Partition, alike, in_parts
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.compile.rewriting.regroup import regroup
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.rewriting.solved import Solved
from spikeport.compile.verdict.lint import Scope


@dataclass(frozen=True)
class Fuse(NetworkPass):
    """Make few large ensembles of many small ones that are wired alike.

    Passthrough nodes between ensembles are multiplied out, what the host sends to an ensemble is
    summed there first, and all that the host reads of one is read at once. Constant input without a
    synapse becomes bias.

    Attributes
    ----------
    max_neurons : int, optional
        The most neurons of an ensemble; by default the input axons of a core, since a relay or
        read-out of an ensemble needs one for each of its neurons.
    """

    name: ClassVar[str] = "fuse"
    precedes: ClassVar[tuple[str, ...]] = ("decode_path",)
    solve: ClassVar[type[Solved]] = Solved
    max_neurons: Annotated[int, Field(ge=1)] | None = None

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Group, and rewrite with matrices."""
        network = rewrite.network
        scope = Scope(network, rewrite.names)
        folded = foldable(network, scope.on_chip)
        most = self.max_neurons or context.chip.limits.most("in_axons")
        whole = [m for m in members(scope, folded) if m.n_neurons <= most]
        groups = [part for group in alike(scope, whole) for part in in_parts(group, most)]
        fused = regroup(rewrite, Partition(groups), folded, context.dt_s, self.solve)
        for what in ("ensembles", "connections"):
            before, after = (getattr(net, f"all_{what}") for net in (network, fused.network))
            context.note(what, {"before": len(before), "after": len(after)})
        return fused
