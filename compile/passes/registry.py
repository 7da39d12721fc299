"""The passes, by name; each is imported when it is first asked for."""

from importlib import import_module

from spikeport.compile.passes.base import AnyPass
from spikeport.errors import UsageError, unknown

PASSES: dict[str, str] = {
    "sparse_inputs": "spikeport.compile.passes.sparse_inputs:SparseInputs",
    "tie": "spikeport.compile.passes.tie:Tie",
    "constant_inputs": "spikeport.compile.passes.constant_inputs:ConstantInputs",
    "split_ensembles": "spikeport.compile.passes.split_ensembles:SplitEnsembles",
    "fuse": "spikeport.compile.passes.fuse:Fuse",
    "decode_path": "spikeport.compile.passes.decode_path:DecodePath",
    "scale_rows": "spikeport.compile.passes.scale_rows:ScaleRows",
    "merge_axons": "spikeport.compile.passes.merge_axons:MergeAxons",
    "split": "spikeport.compile.passes.split:Split",
    "pack": "spikeport.compile.passes.pack:Pack",
    "place": "spikeport.compile.passes.place:Place",
}
"""The passes, in the order that a pipeline can have them."""

PIPELINES = {
    "as_written": "merge_axons,split,pack,place",
    "compact": "split_ensembles,fuse,decode_path,scale_rows,merge_axons,split,pack,place",
    "unpacked": "merge_axons,split,place",
    "compact_unpacked": "split_ensembles,fuse,decode_path,scale_rows,merge_axons,split,place",
}
"""Pipelines with a name. `as_written` computes what nengo-loihi does, bit for bit, on fewer cores,
except where nengo-loihi fails or differs from Nengo (docs/exactness.md). `compact` first rewrites
the network, equal in float, and takes still fewer cores. The other two put one block on a core, for
the first day with a board (docs/board.md)."""


def get(name: str) -> type[AnyPass]:
    """Return the pass of a name.

    Raises
    ------
    UsageError
        If there is no pass of that name; the message lists all passes and pipelines.
    """
    if name in PIPELINES:
        raise UsageError(
            f"'{name}' is a pipeline and takes no options: leave these out, or list its passes: "
            f"{PIPELINES[name]}"
        )
    if name not in PASSES:
        raise unknown("pass or pipeline", name, [*PIPELINES, *PASSES])
    module, _, cls = PASSES[name].partition(":")
    result: type[AnyPass] = getattr(import_module(module), cls)
    return result
