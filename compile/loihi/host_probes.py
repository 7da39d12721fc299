"""Probes of connections that Nengo computes on the host, such as probes of learned weights.

nengo-loihi places only probes of ensembles and nodes, and refuses others as not in the network.
"""

import contextlib
from collections.abc import Iterator
from types import SimpleNamespace

import nengo
from nengo_loihi.splitter import HostChipSplit

from spikeport.compile.ground.names import base
from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def connections_probed_on_host() -> Iterator[None]:
    """Place the probes of connections and their learning rules on the host, within the context."""
    usual = HostChipSplit._place_probes

    def place(split: HostChipSplit, network: nengo.Network) -> None:
        of_connections = [
            probe
            for probe in network.all_probes
            if isinstance(base(probe.target), nengo.Connection)
        ]
        split.host_objs.update(of_connections)
        others = [probe for probe in network.all_probes if probe not in of_connections]
        usual(split, SimpleNamespace(all_probes=others))

    with replaced(HostChipSplit, "_place_probes", place):
        yield
