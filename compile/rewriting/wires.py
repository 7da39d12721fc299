"""Connections as matrices between groups of neurons and the objects that stay.

target += synapse(matrix @ source)
"""

from typing import Any, NamedTuple

import nengo
import scipy.sparse as sparse

NO_GROUP = -1


class Source(NamedTuple):
    """Where a wire begins.

    Either the neurons of a group, or the whole output of an object that stays, or, where this is a
    function or decoded, what a connection from an object that stays computes.
    """

    group: int
    obj: Any = None
    connection: nengo.Connection | None = None

    @property
    def in_group(self) -> bool:
        """Whether it is the neurons of a group."""
        return self.group != NO_GROUP


class Target(NamedTuple):
    """Where a wire ends: the neurons or the dimensions of a group, or an object that stays."""

    kind: str
    group: int
    obj: Any = None

    @property
    def in_group(self) -> bool:
        """Whether it is part of a group."""
        return self.group != NO_GROUP


class Way(NamedTuple):
    """What wires must have in common to be one."""

    source: Source
    target: Target
    synapse: nengo.synapses.Synapse | None
    path: str | None


Wires = dict[Way, sparse.csr_array]
