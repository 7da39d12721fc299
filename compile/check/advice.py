"""A last line of a refusal: the way out, by other passes or without some ensembles."""

import math
from collections.abc import Callable

import nengo

from spikeport.compile.check.lint import lint
from spikeport.compile.check.offload import Offload, problems
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.scope import Scope

COMPACT, AS_WRITTEN = "compact", "as_written"
"""The passes that rewrite a network to take fewer cores, and those that rewrite none."""
TRY_COMPACT = f"more: try -p {COMPACT}, which rewrites it, and may take fewer cores"
OFFLOAD = "more: try --offload, which moves what breaks a rule to the host"
ON_ONE_CORE, MEMORY = "SP012", "SP501"
"""The rules that no pass mends, though none of the network: on weights that learn, which is checked
once they are built, and on the memory of a compile."""
MOST_NEURONS, MOST_CONNECTIONS = 2000, 200
"""The largest network that is rewritten to see what comes of it: a matter of seconds."""


def advice(
    network: nengo.Network,
    error: RefusedError,
    cores_by: Callable[[str], int],
    passes: str | None = COMPACT,
    room: float = math.inf,
) -> str:
    """Return what other passes make of a network, or the way out where none of these can help.

    Parameters
    ----------
    network : nengo.Network
        The network.
    error : RefusedError
        Its refusal.
    cores_by : callable
        Compiles it with some passes, and returns the number of cores, or raises `RefusedError`.
    passes : str or None
        The passes to try: `COMPACT`, or `AS_WRITTEN` where the network was rewritten; None where
        the settings of its build allow no others.
    room : float
        The most neurons that the chip holds.
    """
    if error.everywhere:
        return ""
    names = Names(network)
    ensembles = set(Scope(network, names).ensembles)
    # A chip or the whole network has no ensembles to move; of one, nothing would be left there.
    moves = Offload(network, lambda: None).possible(error)
    movable = bool(moves) and len(moves[0]) < len(ensembles)
    # Rules that no pass mends come first: others would not help.
    unmended = {one.id for one in problems(error)} & {ON_ONE_CORE, MEMORY}
    if passes is None or unmended or lint(network, names, rewritten=False):
        return OFFLOAD * movable
    n_neurons = sum(ensemble.n_neurons for ensemble in ensembles)
    if n_neurons > room:  # no pass takes neurons away
        return OFFLOAD * movable
    if n_neurons > MOST_NEURONS or len(network.all_connections) > MOST_CONNECTIONS:
        # Most of what nengo-loihi's builder refuses is refused in a rewritten network, too.
        worth_it = passes == COMPACT and isinstance(error, DoesNotFitError)
        return TRY_COMPACT if worth_it else OFFLOAD * movable
    try:
        n_cores = cores_by(passes)
    except RefusedError:
        if passes == AS_WRITTEN:  # as is to be expected
            return OFFLOAD * movable
        return f"more: -p {passes} does not compile it either" + "; try --offload" * movable
    return f"more: -p {passes} compiles it, on {n_cores} core{'s' * (n_cores != 1)}"
