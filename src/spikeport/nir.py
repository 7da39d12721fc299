"""NIR, the format in which frameworks exchange spiking networks: graphs as networks for a chip.

::

    network = spikeport.nir.load("graph.nir", dt=1e-3)
    with network:
        nengo.Connection(events, network.inputs["input"], synapse=None)
    with spikeport.Simulator(network) as sim: ...

Needs the extra ``nir``.
"""

import math
from numbers import Real
from pathlib import Path

from spikeport.errors import UsageError
from spikeport.networks.loading.nir.differences import differences
from spikeport.networks.loading.nir.fold import fold
from spikeport.networks.loading.nir.graph import flattened
from spikeport.networks.loading.nir.network import NirNetwork
from spikeport.networks.loading.refusal import refusing
from spikeport.reading.hdf5 import read

__all__ = ["differences", "load"]

CURE = "what can be read: docs/nir.md"


def load(path: str | Path, dt: float, parts: int = 2, at_once: float = 1.0) -> NirNetwork:
    """Read a graph as a network for the chip.

    Parameters
    ----------
    path : str or Path
        The file. It is not trusted: it is read within limits.
    dt : float
        The time step of the graph's equations, in seconds, which NIR does not store. The chip takes
        one of its own steps for each, however long its steps are.
    parts : int
        Synapses per weight: 2 hold 15 bits of it, 1 holds 8 bits in half of the memory.
    at_once : float
        The largest share of a neuron's sources that spike in one step. By default all may. With a
        smaller share weights keep more precision, but more spikes may wrap a register around.

    Raises
    ------
    UsageError
        If it is not a NIR graph, or a node cannot be put on a chip: the message names the node.
    MissingExtraError
        If h5py is absent.
    """
    if not (isinstance(dt, Real) and 0 < dt < math.inf):
        raise UsageError(f"dt={dt}: the time step of a NIR graph is a number of seconds above 0")
    if parts not in (1, 2):
        raise UsageError(f"parts={parts}: the synapses of a weight must be 1 or 2")
    if not (isinstance(at_once, Real) and 0 < at_once <= 1):
        raise UsageError(
            f"at_once={at_once}: the share of a neuron's sources must be above 0 and at most 1"
        )
    path = Path(path)
    with refusing(path, cure=CURE, kind="NIR graph"):
        graph = fold(flattened(read(path)), float(dt))
        return NirNetwork(graph, parts, float(at_once), path.stem)
