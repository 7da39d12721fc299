"""Which ensembles can be taken apart: those nengo-loihi would build without anything special."""

from collections.abc import Iterator, Sequence
from typing import Any

import nengo

from spikeport.compile.names import base
from spikeport.compile.rewriting.passthrough import PLAIN
from spikeport.compile.rewriting.settings import Settings
from spikeport.compile.verdict.lint import NEURON_TYPES, PROBEABLE, REGULAR_BASES, Scope


def members(scope: Scope, folded: Sequence[nengo.Node]) -> list[nengo.Ensemble]:
    """The ensembles on the chip whose neurons may become part of other ensembles.

    Not those that learn, that have a block shape, a transform that is no matrix, or probes of
    anything else than spikes, state and decoded values; nor those that break one of the rules of
    `spikeport.compile.verdict.lint`, which has to see them.
    """
    settings = Settings(scope.network)
    special = set(_special(scope, folded))
    return [
        ensemble
        for ensemble in scope.ensembles
        if ensemble not in special
        and _plain(ensemble)
        and settings.get(ensemble, "block_shape") is None
    ]


def _plain(ensemble: nengo.Ensemble) -> bool:
    kind = ensemble.neuron_type
    regular = type(kind) is nengo.RegularSpiking and type(kind.base_type) in REGULAR_BASES
    both = (ensemble.gain is None) == (ensemble.bias is None)
    return (regular or type(kind) in NEURON_TYPES) and ensemble.noise is None and both


def _special(scope: Scope, folded: Sequence[nengo.Node]) -> Iterator[Any]:
    """Ends of special connections, and what special probes look at."""
    matrices = set(folded)
    for connection in scope.network.all_connections:
        kept = [e for e in (connection.pre_obj, connection.post_obj) if _passthrough(e)]
        if not _ordinary(scope, connection) or any(end not in matrices for end in kept):
            yield base(connection.pre_obj)
            yield base(connection.post_obj)
    for probe in scope.network.all_probes:
        if probe.attr not in PROBEABLE.get(type(probe.obj), ()):
            obj = probe.obj
            ends = [obj.pre_obj, obj.post_obj] if isinstance(obj, nengo.Connection) else [obj]
            yield from map(base, ends)


def _passthrough(obj: Any) -> bool:
    return isinstance(obj, nengo.Node) and obj.output is None


def _ordinary(scope: Scope, connection: nengo.Connection) -> bool:
    """Whether a connection is a matrix and a low-pass filter."""
    whole = isinstance(connection.pre_obj, nengo.Ensemble) and connection.solver.weights
    filtered = scope.on_chip(connection.post_obj) and scope.on_chip(connection.pre_obj)
    return (
        connection.learning_rule_type is None
        and isinstance(connection.transform, PLAIN)
        and (not whole or connection.solver.compositional)
        and (not filtered or type(connection.synapse) in (nengo.Lowpass, type(None)))
    )
