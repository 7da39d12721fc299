"""Probes that record the same of the ensembles that neurons were put into."""

from typing import Any

import nengo
import numpy as np
from nengo.ensemble import Neurons
from nengo.solvers import NoSolver

from spikeport.compile.names import base
from spikeport.compile.rewriting.assembly import Assembly
from spikeport.compile.rewriting.partition import Partition, Place
from spikeport.compile.rewriting.solved import Solved


class StandIns:
    """Finds a stand-in for every probe of an ensemble that is taken apart.

    Parameters
    ----------
    network : nengo.Network
        The network before.
    partition : Partition
        Where its neurons go.
    solved : Solved
        Its decoders.

    Attributes
    ----------
    reads : dict of nengo.Probe to nengo.Connection
        Decodes each probed value as Nengo does: by a connection with the probe's seed. Those of
        ensembles in several parts have to become part of the network.
    """

    def __init__(self, network: nengo.Network, partition: Partition, solved: Solved) -> None:
        self._partition = partition
        self._solved = solved
        self.probes = [p for p in network.all_probes if base(p.obj) in partition]
        self.reads = {p: self._read(p) for p in self.probes if not isinstance(p.obj, Neurons)}

    def in_parts(self) -> list[nengo.Connection]:
        """The reads that no single ensemble can do."""
        return [c for p, c in self.reads.items() if len(self._partition.places[p.obj]) > 1]

    def make(self, assembly: Assembly) -> dict[nengo.Probe, nengo.Probe]:
        """Add the stand-ins to the network that was assembled."""
        with assembly.flat.network:
            return {probe: self._stand_in(probe, assembly) for probe in self.probes}

    def _read(self, probe: nengo.Probe) -> nengo.Connection:
        node = nengo.Node(size_in=probe.size_in, add_to_container=False, label=probe.label)
        connection = nengo.Connection(
            probe.target, node, solver=probe.solver, synapse=None, add_to_container=False
        )
        self._solved.seeds.update({node: 0, connection: self._solved.seeds[probe]})
        return connection

    def _stand_in(self, probe: nengo.Probe, assembly: Assembly) -> nengo.Probe:
        options: dict[str, Any] = {
            "label": probe.label,
            "synapse": probe.synapse,
            "sample_every": probe.sample_every,
        }
        places = self._partition.places[base(probe.obj)]
        if isinstance(probe.obj, Neurons):
            read = np.arange(probe.obj.size_out)[probe.slice or slice(None)]
            (place,) = (p for p in places if p.part.start <= read[0] < p.part.stop)
            neurons = assembly.groups[place.group].neurons
            moved = read - place.part.start + place.neuron
            return nengo.Probe(neurons[_range(moved)], attr=probe.attr, **options)
        if len(places) > 1:
            return nengo.Probe(self.reads[probe].post_obj, **options)
        return self._decoded(probe, places[0], assembly.groups[places[0].group], options)

    def _decoded(
        self, probe: nengo.Probe, place: Place, group: nengo.Ensemble, options: dict[str, Any]
    ) -> nengo.Probe:
        decoders = np.zeros((group.n_neurons, probe.size_in))
        mine = slice(place.neuron, place.neuron + place.part.size)
        decoders[mine] = self._solved.weights(self.reads[probe]).T
        return nengo.Probe(group[: probe.size_in], solver=NoSolver(decoders), **options)


def _range(indices: np.ndarray) -> Any:
    """A slice where the indices are one."""
    if np.all(np.diff(indices) == 1):
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return list(map(int, indices))
