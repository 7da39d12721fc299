"""A flat network under construction: objects of another network, and new ones."""

from typing import Any

import nengo

from spikeport.compile.rewriting.settings import Settings, add_params


class Flat:
    """Starts empty, with the label and the seed of a network.

    Parameters
    ----------
    before : nengo.Network
        The network whose objects it takes over.
    seeds : mapping of Nengo objects to int
        Their seeds.

    Attributes
    ----------
    network : nengo.Network
        The flat network.
    seeds : dict
        Seeds of what was taken over, or made anew from one object.
    """

    def __init__(self, before: nengo.Network, seeds: dict[Any, int]) -> None:
        self._all_seeds = seeds
        self._settings = Settings(before)
        self.network = nengo.Network(label=before.label, seed=seeds[before])
        self.seeds = {self.network: seeds[before]}
        add_params(self.network)

    def keep(self, obj: Any) -> None:
        """Take an object over as it is."""
        with self.network:
            nengo.Network.add(obj)
        self.seeds[obj] = self._all_seeds[obj]
        self._settings.copy(obj, self.network)

    def inherit(self, new: Any, old: Any) -> None:
        """Give a new object the seed of an old one."""
        self.seeds[new] = self._all_seeds[old]
