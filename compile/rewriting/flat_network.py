"""A network without subnetworks, and connections in it that begin like those of another network."""

from collections.abc import Callable

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.connection import FunctionInfo, LearningRule
from nengo.ensemble import Neurons

from spikeport.compile.ground.names import End, Named
from spikeport.compile.ground.notices import warnings_about
from spikeport.compile.ground.rewrite import Seeds
from spikeport.compile.ground.scope import reads_twice, same, source_rows
from spikeport.compile.ground.settings import NetworkSettings, add_params

DECODING = ("function", "eval_points", "scale_eval_points", "solver")
"""The parameters of a connection that decide what it decodes, or computes from a node's output."""


class FlatNetwork:
    """A network without subnetworks, under construction: objects of another network, and new ones.

    Parameters
    ----------
    before : nengo.Network
        The network whose objects it takes over, and whose label and seed it has.
    seeds : mapping of Nengo objects to int
        The seeds of these objects.

    Attributes
    ----------
    network : nengo.Network
        The flat network.
    seeds : dict of Nengo objects to int
        Seeds of objects that were taken over, or made anew from one object.
    """

    def __init__(self, before: nengo.Network, seeds: Seeds) -> None:
        self._all_seeds = seeds
        self._settings = NetworkSettings(before)
        # A network adds itself to the network in whose `with` block it is made, maybe the user's.
        self.network = nengo.Network(before.label, seeds[before], add_to_container=False)
        self.seeds: dict[Named, int] = {self.network: seeds[before]}
        add_params(self.network)

    @classmethod
    def rewired(
        cls,
        before: nengo.Network,
        seeds: Seeds,
        connect: Callable[[nengo.Connection, "FlatNetwork"], None],
    ) -> "FlatNetwork":
        """Return a network with all objects but the connections: ``connect`` makes or keeps each.

        An object that the network lists several times appears once.
        """
        flat = cls(before, seeds)
        for obj in dict.fromkeys((*before.all_ensembles, *before.all_nodes)):
            flat.keep(obj)
        for connection in dict.fromkeys(construction_order(before)):
            connect(connection, flat)
        for probe in dict.fromkeys(before.all_probes):
            flat.keep(probe)
        return flat

    def keep(self, obj: NengoObject) -> None:
        """Take an object over as it is."""
        with self.network:
            nengo.Network.add(obj)
        self.seeds[obj] = self._all_seeds[obj]
        self._settings.copy(obj, self.network)

    def inherit(self, new: NengoObject, old: NengoObject) -> None:
        """Give a new object the seed of an old one."""
        self.seeds[new] = self._all_seeds[old]

    def computed(self, old: nengo.Connection, name: str) -> nengo.Node:
        """Add a node with the values of a connection's function, and return it."""
        pre, options = start(old)
        with self.network, warnings_about(name):
            node = nengo.Node(same, size_in=old.size_mid, label=f"{name} values")
            # Nengo calls a function once to see how many values it returns.
            connection = nengo.Connection(pre, node, synapse=None, **options)
        self.inherit(connection, old)
        return node

    def configure(self, new: NengoObject, old: NengoObject) -> None:
        """Give a new object the settings of an old one."""
        self._settings.copy(old, self.network, onto=new)


def start(connection: nengo.Connection) -> tuple[End, dict[str, object]]:
    """Return the start of a connection like another, and the options of its decoding or function.

    Nengo allows no matrix behind a slice with an entry twice. The new connection then starts at the
    whole source, and its function picks the entries, or its matrix has to: see `sums_up`.
    """
    options = decoding(connection)
    if not reads_twice(connection):
        return connection.pre, options
    if not sums_up(connection):
        options["function"] = FunctionInfo(_of_whole_source(connection), connection.size_mid)
    return connection.pre_obj, options


def decoding(connection: nengo.Connection) -> dict[str, object]:
    """Return the options of a connection's decoding or function; none if it starts at neurons."""
    if isinstance(connection.pre_obj, Neurons):
        return {}
    options = {name: getattr(connection, name) for name in DECODING}
    # With its size, Nengo does not call a function, which may have a state, to find it.
    return {**options, "function": connection.function_info}


def sums_up(connection: nengo.Connection) -> bool:
    """Return whether a slice has an entry twice that no function reads, so that weights add up."""
    computes = isinstance(connection.pre_obj, nengo.Ensemble) or connection.function is not None
    return not computes and reads_twice(connection)


def _of_whole_source(connection: nengo.Connection) -> Callable[[np.ndarray], object]:
    """Return the function of a connection from a slice as a function of its whole source."""
    # The function is not a table of values at points: Nengo refuses one where a slice is read.
    function, rows = connection.function, source_rows(connection)
    return lambda x: x[rows] if function is None else function(x[rows])


def construction_order(network: nengo.Network) -> list[nengo.Connection]:
    """Return all connections of a network, errors of learning last.

    Nengo builds a subnetwork before the connections into it, and so an error after the connection
    that it corrects.
    """
    return sorted(network.all_connections, key=lambda c: isinstance(c.post_obj, LearningRule))
