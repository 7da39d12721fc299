"""A last line of a refusal: the way out for a network that is refused as it is written."""

from collections.abc import Callable

import nengo

from spikeport.compile.check.lint import lint
from spikeport.compile.check.offload import problems
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.scope import Scope

COMPACT = "compact"
"""The passes that rewrite a network to take fewer cores."""
OFFLOAD = "more: try --offload, which moves what breaks a rule to the host"
ON_ONE_CORE = "SP012"
"""The rule on weights that learn, which is checked once they are built, and no pass mends."""
MOST_NEURONS, MOST_CONNECTIONS = 2000, 200
"""The largest network that is rewritten to see what comes of it: a matter of seconds."""


def advice(
    network: nengo.Network,
    error: RefusedError,
    cores_rewritten: Callable[[], int],
    rewritten: bool = False,
) -> str:
    """Return what rewriting makes of a network, or the way out where no pass over it can help.

    Parameters
    ----------
    network : nengo.Network
        The network.
    error : RefusedError
        Its refusal.
    cores_rewritten : callable
        Compiles it with the passes `COMPACT`, and returns the number of cores, or raises
        `RefusedError`.
    rewritten : bool
        True if passes rewrote the network that was refused.
    """
    if error.everywhere:
        return ""
    names, found = Names(network), problems(error)
    # Rules that no pass mends come first: rewriting would not help.
    unmended = lint(network, names, rewritten=False) or any(one.id == ON_ONE_CORE for one in found)
    if rewritten or unmended:
        return OFFLOAD * bool(found)
    n_neurons = sum(ensemble.n_neurons for ensemble in Scope(network, names).ensembles)
    if n_neurons > MOST_NEURONS or len(network.all_connections) > MOST_CONNECTIONS:
        return f"more: try -p {COMPACT}, which rewrites it to take fewer cores"
    try:
        n_cores = cores_rewritten()
    except RefusedError:
        return f"more: -p {COMPACT} does not compile it either; try --offload"
    return f"more: -p {COMPACT} compiles it, on {n_cores} core{'s' * (n_cores != 1)}"
