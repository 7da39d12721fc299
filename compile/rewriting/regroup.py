"""Rewrite a network such that given groups of neurons are one ensemble each."""

from collections.abc import Sequence

import nengo

from spikeport.compile.rewriting.assembly import Assembly
from spikeport.compile.rewriting.partition import Partition
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.rewriting.solved import Solved
from spikeport.compile.rewriting.stand_ins import StandIns
from spikeport.compile.rewriting.wiring import Wiring


def regroup(
    rewrite: Rewrite,
    partition: Partition,
    folded: Sequence[nengo.Node],
    dt_s: float,
    solve: type[Solved] = Solved,
) -> Rewrite:
    """Put a network's neurons into other ensembles, with the same weights.

    Connections from and to the members become matrices, passthrough nodes between them are
    multiplied out, nodes with constant output become biases; everything else stays.

    Parameters
    ----------
    rewrite : Rewrite
        The network.
    partition : Partition
        The groups; see `spikeport.compile.rewriting.members.members` for who may be in one.
    folded : sequence of nengo.Node
        The passthrough nodes to multiply out, sources first.
    dt_s : float
        The time step, in seconds.
    solve : type of Solved
        What gives gains and decoders: those of the chip, or of float neurons.
    """
    network, solved = rewrite.network, solve(rewrite, dt_s)
    stand_ins = StandIns(network, partition, solved)
    reads = stand_ins.in_parts()
    wiring = Wiring(network, reads, solved, partition, folded)
    probed = {probe.obj for probe in network.all_probes}
    wires = dict(wiring.wires)
    for node in folded:
        wires.update(wiring.arriving[node] if node in probed else {})
    assembly = Assembly(rewrite, solved, partition, wires, dt_s)
    gone = {*folded} - probed
    gone.update(partition.places, wiring.replaced, stand_ins.probes)
    sums = [read.post_obj for read in reads]
    nodes, ensembles = [*network.all_nodes, *sums], network.all_ensembles
    for obj in (*ensembles, *nodes, *network.all_connections, *network.all_probes):
        if obj not in gone:
            assembly.flat.keep(obj)
    assembly.connect()
    built = {
        **{ensemble: solved.ensemble(ensemble) for ensemble in partition.places},
        **{c: solved.built(c) for c in wiring.replaced if not _from_host_ensemble(c, partition)},
    }
    new = stand_ins.make(assembly)
    return rewrite.then(assembly.flat.network, new, built, assembly.flat.seeds)


def _from_host_ensemble(connection: nengo.Connection, partition: Partition) -> bool:
    """Whether Nengo's builder decodes it, later, and not nengo-loihi's."""
    pre = connection.pre_obj
    return isinstance(pre, nengo.Ensemble) and pre not in partition
