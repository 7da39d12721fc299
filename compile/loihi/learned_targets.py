"""Passthrough nodes that stay on the host, since connections around them would not do the same."""

import contextlib
from collections.abc import Iterator

from nengo_loihi.passthrough import Cluster, PassthroughSplit

from spikeport.compile.ground.clusters import stays
from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def learned_targets_stay() -> Iterator[None]:
    """Keep, in the context, clusters that learned connections or rates enter, or errors leave."""
    usual = PassthroughSplit._split_cluster

    def split(passthrough: PassthroughSplit, cluster: Cluster) -> None:
        if not stays(cluster.conns_in, cluster.conns_out):
            usual(passthrough, cluster)

    with replaced(PassthroughSplit, "_split_cluster", split):
        yield
