"""Networks in which an object is listed more than once, as flat ones in which each is there once.

Nengo builds an object once, however many networks list it; what goes through lists would count it
again.
"""

import nengo

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.rewriting.assembly import FlatNetwork


def each_once(rewrite: Rewrite) -> Rewrite:
    """Return a network with each of its objects once; itself where none is listed again."""
    network = rewrite.network
    if len(set(network.all_objects)) == len(network.all_objects):
        return rewrite
    flat = FlatNetwork.rewired(network, rewrite.all_seeds(), _keep)
    return rewrite.then(flat.network, {}, {}, flat.seeds)


def _keep(connection: nengo.Connection, flat: FlatNetwork) -> None:
    flat.keep(connection)
