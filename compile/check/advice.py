"""The last line of a refusal: advice to try other passes, or to move ensembles to the host."""

import math
from collections.abc import Callable

import nengo

from spikeport.compile.check.lint import lint
from spikeport.compile.check.offload import Offload, problems
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.scope import Scope
from spikeport.counted import counted

COMPACT, AS_WRITTEN = "compact", "as_written"
"""The passes that rewrite a network to take fewer cores, and those that rewrite nothing."""
TRY_COMPACT = f"more: try -p {COMPACT}, which rewrites the network and may take fewer cores"
OFFLOAD = "more: try --offload, which moves ensembles that are refused to the host"
LEARNING_ON_ONE_CORE, MEMORY = "SP012", "SP501"
"""The rules that no pass mends and `lint` does not check: on weights that learn, which are checked
once they are built, and on the memory of a compile."""
MOST_NEURONS, MOST_CONNECTIONS = 2000, 200
"""The largest network that is compiled with other passes for advice, which takes seconds."""
MOST_PIECES = 40
"""The most pieces into which such a compile cuts ensembles: pieces are connected pair by pair."""


def advice(
    network: nengo.Network,
    error: RefusedError,
    cores_by: Callable[[str], int],
    passes: str | None = COMPACT,
    room: float = math.inf,
    in_axons: float = math.inf,
) -> str:
    """Return a line on what other passes make of a network, or on another cure if they cannot help.

    Parameters
    ----------
    network : nengo.Network
        The network.
    error : RefusedError
        Its refusal.
    cores_by : callable
        Compiles the network with some passes, and returns the number of cores, or raises
        `RefusedError`.
    passes : str or None
        The passes to try: `COMPACT`, or `AS_WRITTEN` where the network was rewritten; None where
        the settings of its build allow no others.
    room : float
        The most neurons that the chip holds.
    in_axons : float
        The input axons of a core: `COMPACT` cuts ensembles of more neurons into pieces.
    """
    if error.everywhere:
        return ""
    scope = Scope(network, Names(network))
    movable = _movable(scope, error)
    otherwise = OFFLOAD if movable else ""
    # If the network breaks a rule that no pass mends, other passes would not help.
    unmended = {one.id for one in problems(error)} & {LEARNING_ON_ONE_CORE, MEMORY}
    if passes is None or unmended or lint(network, scope.names, rewritten=False):
        return otherwise
    sizes = [ensemble.n_neurons for ensemble in scope.ensembles]
    n_neurons = sum(sizes)
    pieces = sum(math.ceil(n / in_axons) for n in sizes if n > in_axons)
    if n_neurons > room or (passes == COMPACT and pieces > MOST_PIECES):
        return otherwise  # no pass removes neurons, and so many pieces take minutes
    if n_neurons > MOST_NEURONS or len(network.all_connections) > MOST_CONNECTIONS:
        # nengo-loihi's builder refuses most of these objects in a rewritten network, too.
        worth_it = passes == COMPACT and isinstance(error, DoesNotFitError)
        return TRY_COMPACT if worth_it else otherwise
    try:
        n_cores = cores_by(passes)
    except RefusedError:
        if passes == AS_WRITTEN:  # as expected
            return otherwise
        cure = "; try --offload" if movable else ""
        return f"more: it does not compile with -p {passes} either{cure}"
    return f"more: it compiles with -p {passes}, on {counted(n_cores, 'core')}"


def _movable(scope: Scope, error: RefusedError) -> bool:
    """Return True if a move of ensembles to the host may help, and leaves some on the chip."""
    # A problem of a chip or of the whole network names no ensembles to move.
    moves = Offload(scope.network, lambda: None).possible(error)
    return bool(moves) and len(moves[0]) < len(set(scope.ensembles))
