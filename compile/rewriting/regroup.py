"""Networks rewritten so that each chosen group of neurons is one ensemble."""

from collections.abc import Iterator, Mapping, Sequence

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.ensemble import Neurons
from nengo.solvers import NoSolver

from spikeport.compile.ground.clusters import Connections, Nodes, clusters
from spikeport.compile.ground.names import base
from spikeport.compile.ground.rewrite import Built, Piece, Rewrite
from spikeport.compile.ground.scope import Scope, neurons_read
from spikeport.compile.loihi.solver import Builder, ParameterSolver
from spikeport.compile.rewriting.assembly import Assembly
from spikeport.compile.rewriting.edges import EdgeMatrices
from spikeport.compile.rewriting.flat_network import construction_order
from spikeport.compile.rewriting.partition import Partition, Position


def regroup(
    rewrite: Rewrite,
    partition: Partition,
    folded: Sequence[nengo.Node],
    dt_s: float,
    builder: Builder | None = None,
    filtered_constants: bool = False,
) -> Rewrite:
    """Put a network's neurons into other ensembles, with the same weights.

    Connections from and to the parts become matrices, passthrough nodes between them are
    multiplied out, nodes with constant output become biases; everything else stays.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    partition : Partition
        The groups, of ensembles that are `spikeport.compile.rewriting.colouring.regroupable`.
    folded : sequence of nengo.Node
        The passthrough nodes to multiply out, sources first. Nodes in which the host sums the input
        of an ensemble that stays are left as they are.
    dt_s : float
        The time step, in seconds.
    builder : Builder, optional
        The builder of gains and decoders; by default `spikeport.compile.loihi.solver.CHIP`.
    filtered_constants : bool
        Constants behind a synapse become biases, too, which act from the first step.

    Raises
    ------
    RefusedError
        If the builder refuses an ensemble or a connection.
    """
    network, solver = rewrite.network, ParameterSolver(rewrite, dt_s, builder)
    summed = set(_summed_on_host(rewrite.scope, partition))
    folded = [node for node in folded if node not in summed]
    probes = ProbeMap(network, partition, solver)
    reads = probes.across_groups()
    matrices = EdgeMatrices(rewrite, reads, solver, partition, folded)
    # A probed passthrough node stays as a target, without connections from it.
    probed = [node for node in folded if any(probe.obj is node for probe in network.all_probes)]
    edges = dict(matrices.edges)
    for node in probed:
        edges.update(matrices.into_nodes[node])
    constants = _summed_constants(rewrite.scope)
    assembly = Assembly(rewrite, solver, partition, edges, filtered_constants, constants)
    gone = {*folded, *partition.places, *matrices.replaced, *probes.replaced}.difference(probed)
    for obj in _in_order(network, [read.post_obj for read in reads]):
        if obj not in gone:
            assembly.flat.keep(obj)
    assembly.connect()
    return rewrite.then(
        assembly.flat.network,
        assembly.flat.seeds,
        built=_built(matrices, partition, solver),
        stand_ins=probes.replacements(assembly),
        pieces=_pieces(rewrite, partition, assembly.ensembles),
        members=_members(rewrite, partition, assembly.ensembles),
        encoded=assembly.encoded,
    )


def _in_order(network: nengo.Network, sums: Sequence[nengo.Node]) -> Iterator[NengoObject]:
    """Yield a network's objects and the nodes that sum its probes, in the order they are kept."""
    yield from network.all_ensembles
    yield from network.all_nodes
    yield from sums
    yield from construction_order(network)
    yield from network.all_probes


def _summed_on_host(scope: Scope, partition: Partition) -> Iterator[nengo.Node]:
    """Yield the nodes in which the host sums what it sends to ensembles that stay.

    Without them, each term would be sent, and cut off, by itself.
    """
    for cluster, connections in _host_clusters(scope):
        behind = [c.post_obj for c in connections if c.post_obj not in cluster]
        if any(scope.on_chip(end) and base(end) not in partition for end in behind):
            yield from cluster


def _summed_constants(scope: Scope) -> set[nengo.Node]:
    """Return the nodes with constant output that the host adds to other values."""
    return {
        c.pre_obj
        for cluster, connections in _host_clusters(scope)
        for c in connections
        if c.pre_obj not in cluster and isinstance(c.pre_obj, nengo.Node)
    }


def _host_clusters(scope: Scope) -> Iterator[tuple[Nodes, Connections]]:
    """Yield the passthrough nodes that sum values on the host, and the connections around them."""
    for cluster, connections in clusters(scope.network):
        if not any(scope.on_chip(c.pre_obj) for c in connections if c.pre_obj not in cluster):
            yield cluster, connections


def _built(
    matrices: EdgeMatrices, partition: Partition, solver: ParameterSolver
) -> dict[NengoObject, Built]:
    """Return the built parameters of the ensembles and connections that are gone."""
    built = {ensemble: solver.ensemble(ensemble) for ensemble in partition.places}
    for connection in matrices.replaced:
        pre = connection.pre_obj
        # The decoders of an ensemble that stays are solved later, by its own builder.
        if not isinstance(pre, nengo.Ensemble) or pre in partition:
            built[connection] = solver.built(connection)
    return built


def _pieces(
    rewrite: Rewrite, partition: Partition, ensembles: Sequence[nengo.Ensemble]
) -> dict[nengo.Ensemble, Piece]:
    """Return the new ensembles that are a piece of one ensemble, which was cut now or before."""
    pieces = {}
    for number, (ensemble, group) in enumerate(zip(ensembles, partition.groups, strict=True)):
        if len(group) > 1:
            continue
        owner = group[0].ensemble
        groups = [place.group for place in partition.places[owner]]
        if len(groups) > 1:
            name = rewrite.names[owner]
            pieces[ensemble] = Piece(name, groups.index(number), len(groups))
        elif owner in rewrite.pieces:
            pieces[ensemble] = rewrite.pieces[owner]
    return pieces


def _members(
    rewrite: Rewrite, partition: Partition, ensembles: Sequence[nengo.Ensemble]
) -> dict[nengo.Ensemble, tuple[str, ...]]:
    """Return the names of the user's ensembles in each new ensemble that has several."""
    members = {}
    for ensemble, group in zip(ensembles, partition.groups, strict=True):
        names = [name for part in group for name in rewrite.users_names(part.ensemble)]
        if len(group) > 1:
            members[ensemble] = tuple(dict.fromkeys(names))
    return members


class ProbeMap:
    """The probes of ensembles that are split, and the probes that replace them.

    Parameters
    ----------
    network : nengo.Network
        The network before.
    partition : Partition
        The groups of its neurons.
    solver : ParameterSolver
        Solves its decoders.

    Attributes
    ----------
    replaced : list of nengo.Probe
        The probes of ensembles in the partition.
    """

    def __init__(
        self, network: nengo.Network, partition: Partition, solver: ParameterSolver
    ) -> None:
        self._partition = partition
        self._solver = solver
        self.replaced = [p for p in network.all_probes if base(p.obj) in partition]
        self._reads = {p: self._read(p) for p in self.replaced if not isinstance(p.obj, Neurons)}

    def across_groups(self) -> list[nengo.Connection]:
        """Return the connections that decode probed values as sums over several groups."""
        return [c for p, c in self._reads.items() if len(self._partition.places[p.obj]) > 1]

    def replacements(self, assembly: Assembly) -> dict[nengo.Probe, nengo.Probe]:
        """Add probes that record the same values to the assembled network, and return them."""
        with assembly.flat.network:
            return {probe: self._replacement(probe, assembly) for probe in self.replaced}

    def _read(self, probe: nengo.Probe) -> nengo.Connection:
        """Return a connection, in no network, that decodes the values that a probe records."""
        node = nengo.Node(size_in=probe.size_in, add_to_container=False, label=probe.label)
        connection = nengo.Connection(
            probe.target, node, solver=probe.solver, synapse=None, add_to_container=False
        )
        # Nengo decodes a probe by a connection of its own, which has the probe's seed.
        self._solver.seeds.update({node: 0, connection: self._solver.seeds[probe]})
        return connection

    def _replacement(self, probe: nengo.Probe, assembly: Assembly) -> nengo.Probe:
        options: dict[str, object] = {
            "label": probe.label,
            "synapse": probe.synapse,
            "sample_every": probe.sample_every,
        }
        places = self._partition.places[base(probe.obj)]
        if isinstance(probe.obj, Neurons):
            read = neurons_read(probe)
            (place,) = (p for p in places if p.part.start <= read[0] < p.part.stop)
            neurons = assembly.ensembles[place.group].neurons
            moved = read - place.part.start + place.neuron
            return nengo.Probe(neurons[_index(moved)], attr=probe.attr, **options)
        if len(places) > 1:
            return nengo.Probe(self._reads[probe].post_obj, **options)
        return self._decoded(probe, places[0], assembly.ensembles[places[0].group], options)

    def _decoded(
        self,
        probe: nengo.Probe,
        place: Position,
        ensemble: nengo.Ensemble,
        options: Mapping[str, object],
    ) -> nengo.Probe:
        """Make a probe of an ensemble's value that reads the neurons of one part alone."""
        decoders = np.zeros((ensemble.n_neurons, probe.size_in))
        mine = slice(place.neuron, place.neuron + place.part.size)
        decoders[mine] = self._solver.weights(self._reads[probe]).T
        # The decoders are known. The slice only sets the number of values, which may be larger than
        # the number of dimensions.
        values = ensemble[[0] * probe.size_in]
        return nengo.Probe(values, solver=NoSolver(decoders), **options)


def _index(numbers: np.ndarray) -> slice | list[int]:
    """Return numbers as an index: a slice, where they are consecutive."""
    if np.all(np.diff(numbers) == 1):
        return slice(int(numbers[0]), int(numbers[-1]) + 1)
    return list(map(int, numbers))
