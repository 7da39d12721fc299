"""`Fuse`: small ensembles that are wired alike become large ones."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.solver import Builder
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.compile.rewriting.colouring import alike, regroupable
from spikeport.compile.rewriting.partition import Partition, in_parts
from spikeport.compile.rewriting.passthrough import foldable
from spikeport.compile.rewriting.regroup import regroup


@dataclass(frozen=True)
class Fuse(NetworkPass):
    """Fuse many small ensembles that are wired alike into few large ones.

    Passthrough nodes between ensembles are multiplied out. The host sums the values that it sends
    to an ensemble (and cuts off the sum at the radius, in place of each term), and reads all values
    of an ensemble at once. Constant input without a synapse becomes bias.

    Attributes
    ----------
    max_neurons : int, optional
        The most neurons of an ensemble; by default the number of input axons of a core, since a
        relay or read-out needs one for each neuron of its ensemble.
    """

    name: ClassVar[str] = "fuse"
    precedes: ClassVar[tuple[str, ...]] = ("decode_path",)
    max_neurons: Annotated[int, Field(ge=1)] | None = None

    def apply(self, rewrite: Rewrite, context: Context, builder: Builder | None = None) -> Rewrite:
        """Group the ensembles, and rewrite their connections with matrices.

        Parameters
        ----------
        rewrite : Rewrite
            The network.
        context : Context
            The chip and the time step.
        builder : Builder, optional
            The builder of gains and decoders; by default that of the chip.
        """
        scope = rewrite.scope
        folded = foldable(scope)
        # A relay or a read-out has an input axon for each neuron that it decodes.
        most = self.max_neurons or context.chip.limits.most("in_axons")
        # Larger ensembles stay as they are: another pass cuts them.
        whole = [e for e in regroupable(scope, folded) if e.n_neurons <= most]
        groups = [part for group in alike(scope, whole) for part in in_parts(group, most)]
        fused = regroup(rewrite, Partition(groups), folded, context.dt_s, builder)
        for kind in ("ensembles", "connections"):
            before, after = (getattr(one.network, f"all_{kind}") for one in (rewrite, fused))
            context.note_change(kind, len(before), len(after))
        return fused
