"""Hints where a rewritten network takes more cores, or loses more, than the network as written.

The network is compiled once more, without the passes that rewrite it.
"""

from collections.abc import Iterator

import nengo

from spikeport.compile.check import rules
from spikeport.compile.check.violation import Violation
from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.passes.registry import PIPELINES
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.counted import percent
from spikeport.errors import CompileError

MORE = 0.05
"""Share by which an error is more than another: those of two seeds differ by as much."""
MOST_ENSEMBLES = 300
"""Ensembles of a network above which compiling it as written may take minutes."""


def is_rewritten(network: nengo.Network, passes: str | Pipeline) -> bool:
    """Return True if passes rewrite a network that is small enough to be compiled as written."""
    pipeline = parse(passes) if isinstance(passes, str) else passes
    return bool(pipeline.networks) and len(network.all_ensembles) <= MOST_ENSEMBLES


def as_written(network: nengo.Network, chip: str, passes: str | Pipeline) -> Compilation | None:
    """Compile a network as written; None if no pass rewrites it, if it is large, or if it fails."""
    if not is_rewritten(network, passes):
        return None
    try:
        return compile_network(network, chip, pipeline=PIPELINES["as_written"])
    except CompileError:  # the network needs the passes
        return None


def more_cores(found: Compilation, written: Compilation) -> Iterator[Violation]:
    """Yield a hint if a compile takes more cores than the compile of the network as written."""
    cores, least = found.image.n_cores, written.image.n_cores
    if cores > least:
        yield rules.get("SP411").broken("the network", f"{cores}, as written {least}")


def more_loss(error: float | None, written: float | None) -> Iterator[Violation]:
    """Yield a hint if probes are clearly further off than those of the network as written."""
    if error is not None and written is not None and error > (1 + MORE) * written:
        used = f"{percent(error)} off, as written {percent(written)}"
        yield rules.get("SP412").broken("probes", used)
