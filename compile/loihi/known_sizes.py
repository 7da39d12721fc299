"""Sizes of functions, which Nengo otherwise finds by calling them.

nengo-loihi replaces a connection from the host to the chip by new ones with the same function. A
function with a state, such as a random generator, would be called more often in a run after a
compile than in one whose compile comes from the cache.
"""

import contextlib
from collections.abc import Callable, Iterator

import nengo
from nengo.connection import ConnectionFunctionParam

from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def sizes_known(network: nengo.Network) -> Iterator[None]:
    """Let new connections have functions of a network's without a call, in the context."""
    sizes = {
        (id(connection.function), connection.size_in): connection.function_info.size
        for connection in network.all_connections
        if callable(connection.function)
    }
    usual = ConnectionFunctionParam.determine_size

    def determine_size(
        self: ConnectionFunctionParam, instance: nengo.Connection, function: Callable[..., object]
    ) -> int:
        known = sizes.get((id(function), instance.size_in))
        return int(usual(self, instance, function) if known is None else known)

    with replaced(ConnectionFunctionParam, "determine_size", determine_size):
        yield
