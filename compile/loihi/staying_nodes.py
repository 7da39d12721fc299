"""Passthrough nodes that stay on the host, since connections around them would not do the same."""

import contextlib
from collections.abc import Iterator

from nengo_loihi.passthrough import Cluster, PassthroughSplit

from spikeport.compile.ground.clusters import stays
from spikeport.compile.ground.names import base
from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def nodes_stay() -> Iterator[None]:
    """Keep, in the context, the clusters that `stays` names."""
    usual = PassthroughSplit._split_cluster

    def split(passthrough: PassthroughSplit, cluster: Cluster) -> None:
        network, hostchip = passthrough.network, passthrough.hostchip
        touching = (*cluster.conns_in, *cluster.conns_mid, *cluster.conns_out)
        probed = {probe.obj for probe in network.all_probes}
        if not stays(touching, lambda end: hostchip.on_chip(base(end)), probed):
            usual(passthrough, cluster)

    with replaced(PassthroughSplit, "_split_cluster", split):
        yield
