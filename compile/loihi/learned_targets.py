"""Passthrough nodes that stay on the host, since connections around them would not do the same.

nengo-loihi replaces clusters of passthrough nodes by connections that do not learn, and then fails
on the error's connection to a learning rule that is gone. It also fails if an error passes a node
that feeds the chip, too. It would send the rates of neurons on the host as spikes.
"""

import contextlib
from collections.abc import Iterator

import nengo
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo_loihi.passthrough import Cluster, PassthroughSplit

from spikeport.compile.loihi.replaced import replaced


@contextlib.contextmanager
def learned_targets_stay() -> Iterator[None]:
    """Keep, in the context, clusters that learned connections or rates enter, or errors leave."""
    usual = PassthroughSplit._split_cluster

    def split(passthrough: PassthroughSplit, cluster: Cluster) -> None:
        learned = any(c.learning_rule_type is not None for c in cluster.conns_in)
        teaches = any(isinstance(c.post_obj, LearningRule) for c in cluster.conns_out)
        if not (learned or teaches or any(map(_sends_rates, cluster.conns_in))):
            usual(passthrough, cluster)

    with replaced(PassthroughSplit, "_split_cluster", split):
        yield


def _sends_rates(connection: nengo.Connection) -> bool:
    """Return whether a connection starts at neurons that do not spike; those are on the host."""
    pre = connection.pre_obj
    return isinstance(pre, Neurons) and not pre.ensemble.neuron_type.spiking
