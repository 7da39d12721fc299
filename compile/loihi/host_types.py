"""Neurons of our own types for the host, which nengo-loihi places there only by a setting of each.

The setting is the outermost network's, but a NIR graph may be a part of a larger network.
"""

import contextlib
from collections.abc import Iterator

import nengo
from nengo_loihi.splitter import HostChipSplit

from spikeport.compile.loihi.replaced import replaced
from spikeport.neurons import HOST_TYPES


@contextlib.contextmanager
def host_types_stay() -> Iterator[None]:
    """Place ensembles of `spikeport.neurons.HOST_TYPES` on the host, within the context."""
    usual = HostChipSplit._place_ensembles

    def place(split: HostChipSplit, network: nengo.Network) -> None:
        usual(split, network)
        ours = {e for e in network.all_ensembles if isinstance(e.neuron_type, HOST_TYPES)}
        split.chip_objs.difference_update(ours)
        split.host_objs.update(ours)

    with replaced(HostChipSplit, "_place_ensembles", place):
        yield
