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
from spikeport.hardware_models.chip import ChipModel

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
    chip: ChipModel,
    cores_by: Callable[[str], int],
    passes: str | None,
) -> str:
    """Return a line on what other passes make of a network, or on another cure if they cannot help.

    Parameters
    ----------
    network : nengo.Network
        The network.
    error : RefusedError
        Its refusal.
    chip : ChipModel
        The chip. `COMPACT` cuts ensembles of more neurons than a core has input axons into pieces.
    cores_by : callable
        Compiles the network with some passes, and returns the number of cores, or raises
        `RefusedError`.
    passes : str or None
        The passes to try: `COMPACT`, or `AS_WRITTEN` where the network was rewritten; None where
        the settings of its build allow no others.
    """
    if error.everywhere:
        return ""
    scope = Scope(network, Names(network))
    movable = _movable(scope, error)
    otherwise = OFFLOAD if movable else ""
    if passes is None or _are_useless(passes, scope, error, chip):
        return otherwise
    if _is_large(scope):
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


def _are_useless(passes: str, scope: Scope, error: RefusedError, chip: ChipModel) -> bool:
    """Return whether passes would not help, or take minutes to be tried."""
    unmended = {one.id for one in problems(error)} & {LEARNING_ON_ONE_CORE, MEMORY}
    if unmended or lint(scope, rewritten=False):
        return True
    sizes = [ensemble.n_neurons for ensemble in scope.ensembles]
    room, in_axons = chip.limits.most("compartments"), chip.limits.most("in_axons")
    pieces = sum(math.ceil(n / in_axons) for n in sizes if n > in_axons)
    # No pass removes neurons.
    return sum(sizes) > room * chip.n_cores or (passes == COMPACT and pieces > MOST_PIECES)


def _is_large(scope: Scope) -> bool:
    """Return whether a network is too large to be compiled for advice."""
    n_neurons = sum(ensemble.n_neurons for ensemble in scope.ensembles)
    n_connections = len(scope.network.all_connections)
    return n_neurons > MOST_NEURONS or n_connections > MOST_CONNECTIONS


def _movable(scope: Scope, error: RefusedError) -> bool:
    """Return True if a move of ensembles to the host may help, and leaves some on the chip."""
    # A problem of a chip or of the whole network names no ensembles to move.
    moves = Offload(scope.network, lambda: None).possible(error)
    return bool(moves) and len(moves[0]) < len(set(scope.ensembles))
