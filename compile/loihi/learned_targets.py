"""Passthrough nodes that a learned connection ends in: they stay, on the host.

nengo-loihi replaces clusters of passthrough nodes by connections that do not learn, and then fails
on the error's connection to a rule that is gone.
"""

import contextlib
from collections.abc import Iterator

from nengo_loihi.passthrough import Cluster, PassthroughSplit

from spikeport.compile.ground.refusal import TURN
from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def learned_targets_stay() -> Iterator[None]:
    """Keep the clusters that learned connections enter, within the context."""
    usual = PassthroughSplit._split_cluster

    def split(passthrough: PassthroughSplit, cluster: Cluster) -> None:
        if all(connection.learning_rule_type is None for connection in cluster.conns_in):
            usual(passthrough, cluster)

    with TURN, replaced(PassthroughSplit, "_split_cluster", split):
        yield
