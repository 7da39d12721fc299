"""Loops between chip and host that are slower than in float Nengo: rule SP415.

Values that the host sends wait to be encoded as spikes, and pass a filter of 5 ms on the chip.
Values that the chip sends back arrive a step later.
"""

from collections.abc import Iterator, Sequence

import nengo
import numpy as np
import scipy.sparse as sparse
from nengo.connection import LearningRule

from spikeport.compile.check import rules
from spikeport.compile.check.loops import LATE, Part, loops
from spikeport.compile.check.violation import Violation
from spikeport.compile.ground.filters import DECODE_TAU_S, delay_s
from spikeport.compile.ground.names import base
from spikeport.compile.ground.scope import Scope, is_passthrough

STEPS = 3
"""Steps from a node over an ensemble to a node, beyond those in float Nengo and the filter of 5 ms.
Measured by the phase of a sine, filter and steps take 7.1, 8.4 and 10.7 ms together, with steps of
0.5, 1 and 2 ms."""
NAMED = 6
"""The most objects of a loop that are all named."""
INSTANT_S = 1e-9
"""The length of a connection without a filter, since sparse matrices have no edges of length 0."""


def host_loop_hints(scope: Scope, dt_s: float) -> Iterator[Violation]:
    """Yield a hint on each slower loop between chip and host; it names the fastest path around.

    Parameters
    ----------
    scope : Scope
        The network.
    dt_s : float
        The time step, in seconds.
    """
    late_s = DECODE_TAU_S + STEPS * dt_s
    # An error that a learning rule receives goes around no loop: it only corrects decoders.
    around_any = [
        c for c in scope.network.all_connections if not isinstance(c.post_obj, LearningRule)
    ]
    for connections in loops(around_any):
        own_s, around = _fastest(connections, scope)
        if around and late_s > LATE * own_s:
            delays = f"{1000 * own_s:.3g} ms became about {1000 * (own_s + late_s):.3g} ms"
            yield rules.get("SP415").broken(_listed([scope.names[one] for one in around]), delays)


def _fastest(connections: Sequence[nengo.Connection], scope: Scope) -> tuple[float, list[Part]]:
    """Return the sum of delays of the fastest path to the host and back, and its parts.

    The result for a loop that is all on one side is 0 and no parts. Passthrough nodes are on
    neither side. Filters whose delay is not known do not count as paths.
    """
    parts = list(dict.fromkeys(base(end) for c in connections for end in (c.pre_obj, c.post_obj)))
    chip = [i for i, part in enumerate(parts) if scope.on_chip(part)]
    on_chip = set(chip)
    host = [i for i, part in enumerate(parts) if i not in on_chip and not is_passthrough(part)]
    if not chip or not host:
        return 0.0, []
    graph = _lengths(connections, {part: i for i, part in enumerate(parts)})
    backwards = sparse.csr_array(graph.T)
    fastest_s, around = np.inf, list[int]()
    # From one start at a time: all of them would take (hosts, parts) numbers.
    for start in host:
        there, after = sparse.csgraph.dijkstra(graph, indices=start, return_predecessors=True)
        back, before = sparse.csgraph.dijkstra(backwards, indices=start, return_predecessors=True)
        whole = (there + back)[chip]
        turn = chip[int(np.argmin(whole))]
        if whole.min() < fastest_s:
            fastest_s = float(whole.min())
            around = [*_path(after, turn, start)[::-1], *_path(before, turn, start)[1:]]
    return fastest_s - INSTANT_S * (len(around) - 1), [parts[i] for i in around]


def _lengths(connections: Sequence[nengo.Connection], at: dict[Part, int]) -> sparse.csr_array:
    """Return the delays between parts as a matrix; the fastest connection of a pair counts."""
    length = sparse.dok_array((len(at), len(at)))
    for c in connections:
        late_s = delay_s(c.synapse)
        if late_s is not None:
            ends, own_s = (at[base(c.pre_obj)], at[base(c.post_obj)]), INSTANT_S + max(late_s, 0.0)
            length[ends] = min(length.get(ends, own_s), own_s)
    return sparse.csr_array(length)


def _path(before: np.ndarray, end: int, start: int) -> list[int]:
    """Follow the predecessors from an end back to its start, and return the path."""
    path = [end]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    return path


def _listed(names: Sequence[str]) -> str:
    """Return names joined by arrows; from a long row, only those at its ends."""
    if len(names) > NAMED:
        half = NAMED // 2
        names = [*names[:half], f"{len(names) - 2 * half} more", *names[-half:]]
    return " -> ".join(names)
