"""A network on its way through the network passes, and the replacements of the user's objects."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeAlias

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.builder.connection import BuiltConnection
from nengo.builder.ensemble import BuiltEnsemble
from nengo.builder.network import seed_network

from spikeport.compile.ground.names import Named, Names
from spikeport.compile.ground.scope import Scope

Built: TypeAlias = BuiltEnsemble | BuiltConnection
"""Gains, encoders and weights, as Nengo's builder keeps them."""
Seeds: TypeAlias = Mapping[Named, int]
"""The seeds of objects and of their network."""
NOTHING: Mapping[Any, Any] = MappingProxyType({})


@dataclass(frozen=True)
class Piece:
    """A place in the row of ensembles that one ensemble was cut into.

    Attributes
    ----------
    owner : str
        The name of the ensemble that was cut.
    number : int
        The position among the pieces, from 0.
    count : int
        The number of pieces.
    """

    owner: str
    number: int
    count: int


@dataclass(frozen=True)
class Rewrite:
    """A network and its relation to the one that the user wrote.

    A pass puts objects that it need not change into its network as they are, and never alters them.
    ``stand_ins`` maps the user's probes to the probes that record the same values here; ``built``
    maps the user's ensembles and connections that are no longer here to what Nengo built for them.
    Objects in neither mapping are themselves in this network.

    Attributes
    ----------
    network : nengo.Network
        The network.
    names : Names
        Names of its objects.
    stand_ins, built : mapping
        See above.
    seeds : mapping of Nengo objects to int
        The seeds that Nengo would draw for objects in their old place.
    pieces : mapping of nengo.Ensemble to Piece
        The ensembles of the network that are pieces of an ensemble that was cut.
    input_weight : float, optional
        The value that a spike in every step from the host stands for, if the host's neurons are
        silent at zero; None: they are nengo-loihi's.
    members : mapping of str to tuple of str
        The names of the user's ensembles that each fused ensemble is made of, by its name.
    encoded : mapping of nengo.Connection to (n,) array
        The connections to neurons that encode n values, in units of the ensemble's radius, and the
        dimensions of these values: their weights are the ensemble's encoders.
    """

    network: nengo.Network
    names: Names
    stand_ins: Mapping[nengo.Probe, nengo.Probe] = field(default_factory=dict)
    built: Mapping[NengoObject, Built] = field(default_factory=dict)
    seeds: Seeds = field(default_factory=dict)
    pieces: Mapping[nengo.Ensemble, Piece] = field(default_factory=dict)
    input_weight: float | None = None
    members: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    encoded: Mapping[nengo.Connection, np.ndarray] = field(default_factory=dict)

    @property
    def scope(self) -> Scope:
        """The network, the names of its objects, and which of them go onto the chip."""
        return Scope(self.network, self.names)

    def all_seeds(self) -> dict[Named, int]:
        """Return the seed of every object; a network without a seed counts as seeded with 0."""
        network = self.network
        seeds = {**self.seeds}
        seeds.setdefault(network, 0 if network.seed is None else network.seed)
        seed_network(network, seeds=seeds, seeded={})
        return seeds

    def then(
        self,
        network: nengo.Network,
        seeds: Seeds,
        *,
        built: Mapping[NengoObject, Built] = NOTHING,
        stand_ins: Mapping[nengo.Probe, nengo.Probe] = NOTHING,
        pieces: Mapping[nengo.Ensemble, Piece] = NOTHING,
        members: Mapping[nengo.Ensemble, tuple[str, ...]] = NOTHING,
        encoded: Mapping[nengo.Connection, np.ndarray] = NOTHING,
    ) -> "Rewrite":
        """Return the rewrite that follows this one, with another network and its seeds.

        A stand-in of a stand-in stands in for the user's own probe. ``pieces`` are the pieces among
        the new ensembles; ensembles that stay in the network remain the pieces they were.
        ``members`` are the names of the user's ensembles that each new ensemble fuses, ``encoded``
        the new connections that encode.
        """
        users = {probe: stand_ins.get(now, now) for probe, now in self.stand_ins.items()}
        known = set(self.stand_ins.values())
        first = {probe: new for probe, new in stand_ins.items() if probe not in known}
        names = {obj: self.names[obj] for obj in network.all_objects if obj in self.names}
        names[network] = self.names[self.network]
        names.update({new: self.names[now] for now, new in stand_ins.items()})
        named = Names(network, names)
        kept = {e: self.pieces[e] for e in network.all_ensembles if e in self.pieces}
        encodes = {c: self.encoded[c] for c in network.all_connections if c in self.encoded}
        return Rewrite(
            network,
            named,
            {**first, **users},
            {**self.built, **built},
            seeds,
            {**kept, **pieces},
            self.input_weight,
            {**self.members, **{named[one]: found for one, found in members.items()}},
            {**encodes, **encoded},
        )

    def users_names(self, ensemble: nengo.Ensemble) -> tuple[str, ...]:
        """Return the names of the user's ensembles that an ensemble stands for.

        These are its own name, the name of the ensemble that it is a piece of, or the names of the
        ensembles that are fused in it.
        """
        return self.unfused([self.names[ensemble]])

    def unfused(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return names of objects, a piece's replaced by its owner's, a fused one's by members'."""
        owners = {self.names[e]: piece.owner for e, piece in self.pieces.items()}
        whole = [owners.get(name, name) for name in names]
        return tuple(one for name in whole for one in self.members.get(name, (name,)))
