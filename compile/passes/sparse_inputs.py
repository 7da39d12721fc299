"""`SparseInputs`: the host sends spikes for a value's distance from zero, and none at zero."""

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from pydantic import Field

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.passes.base import Context, NetworkPass


@dataclass(frozen=True)
class SparseInputs(NetworkPass):
    """Let the host send spikes for a value's distance from zero, not one in every step.

    nengo-loihi encodes a value by two neurons on the host, which together average one spike a step,
    whatever the value. Here both are at threshold at zero: a value x, in units of the target's
    radius, takes |x| / weight spikes a step. The sum that arrives has the same mean. The rest that
    a neuron still has to send is from 0 to ``weight``; that of nengo-loihi's pair is from -1 to 1.
    While a value keeps its sign, its error is thus the same with a weight of 2, and half with 1.

    The network itself stays as it is. With a weight of 1, the image also stays the same, except for
    the encoding of its inputs. Values saturate at ``weight`` in place of 1.

    Attributes
    ----------
    weight : float
        The value that a spike in every step stands for.
    """

    name: ClassVar[str] = "sparse_inputs"
    weight: Annotated[float, Field(ge=1, le=100, allow_inf_nan=False)] = 2.0

    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Set the encoding of all values that the host sends."""
        return replace(rewrite, input_weight=self.weight)
