"""Networks that list an object more than once, as flat networks that list each object once.

Nengo builds an object once, however many networks list it, but code that goes through the lists
would count it again.
"""

import nengo

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.rewriting.flat_network import FlatNetwork


def each_once(rewrite: Rewrite) -> Rewrite:
    """Return a network that lists each object once; the same network if it already does."""
    network = rewrite.network
    if len(set(network.all_objects)) == len(network.all_objects):
        return rewrite
    flat = FlatNetwork.rewired(network, rewrite.all_seeds(), _keep)
    return rewrite.then(flat.network, flat.seeds)


def _keep(connection: nengo.Connection, flat: FlatNetwork) -> None:
    flat.keep(connection)
