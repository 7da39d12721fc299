"""Network -> blocks: nengo-loihi's builder and discretiser, the same in every process.

The builder and the discretiser are used as they are: they define the arithmetic. What is added is
order. nengo-loihi replaces clusters of passthrough nodes by connections that come from a set and
have no seed; here they are sorted by name and seeded, so that one network gives one image.
"""

import contextlib
import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import nengo
import numpy as np
from nengo.ensemble import Neurons
from nengo_loihi.block import LoihiBlock
from nengo_loihi.builder import Model
from nengo_loihi.builder.builder import ValidationLevel

from spikeport.compile.discretise import discretise
from spikeport.compile.names import Names
from spikeport.compile.numpy1 import numpy1_semantics
from spikeport.compile.quantisation import BlockError, FloatBlock, block_error
from spikeport.compile.refusal import RefusedError, collected_warnings, without_addresses
from spikeport.compile.rewriting.lean import lean
from spikeport.compile.rewriting.relay import RELAYS, relayed
from spikeport.compile.verdict.finite import refused_or_not_finite

SEED_LIMIT = 2**31 - 1
NAMED = (nengo.Ensemble, nengo.Node, nengo.Connection, nengo.Probe)


@dataclass(frozen=True)
class Blocks:
    """What the builder made of a network: integer blocks, their names, and what rounding cost.

    ``model`` is nengo-loihi's, discretised; ``labels`` names its blocks; ``errors`` holds the
    quantisation error of each block; ``warnings`` what the builder said on the way; ``floats`` the
    values of each block before.
    """

    model: Model
    labels: dict[Any, str]
    errors: tuple[BlockError, ...]
    warnings: tuple[str, ...]
    floats: dict[LoihiBlock, FloatBlock]


class OrderedModel(Model):
    """nengo-loihi's model, which also remembers what it is building, for error messages."""

    def __init__(self, dt_s: float, names: Names) -> None:
        super().__init__(dt=dt_s, label="spikeport")
        self.names = names
        self.building = "network"
        # Limits are checked by spikeport.compile.verdict.verify, which reports all of them at once.
        self.validation_level = ValidationLevel.NONE

    def build(self, obj: Any, *args: Any, **kwargs: Any) -> Any:
        """Build one object; passthrough replacements are put in order before the first of them."""
        if self.split is not None:
            self._order_passthrough()
        if isinstance(obj, NAMED):
            self.building = self.names[obj]
        if self.seeds.get(obj, 0) is None:
            self.seeds[obj] = _seed_from(self.names[obj])
        with self._path(obj):
            return super().build(obj, *args, **kwargs)

    def _path(self, obj: Any) -> contextlib.AbstractContextManager[None]:
        """What the network's config asks for: decode neurons of a kind, or none."""
        if isinstance(obj, nengo.Connection) and self.config is not None:
            options = self.config[obj]
            path = options.decode_path if "decode_path" in options._clsparams.params else "auto"
            if path in RELAYS:
                return relayed(self, obj, path)
            if path == "direct" and isinstance(obj.post_obj, Neurons):
                return lean(self, obj)
        return contextlib.nullcontext()

    def _order_passthrough(self) -> None:
        passthrough = self.split.passthrough
        if isinstance(passthrough.to_add, set):
            passthrough.to_add = sorted(passthrough.to_add, key=self._sort_key)

    def _sort_key(self, connection: nengo.Connection) -> tuple[str, ...]:
        ends = (self.names[connection.pre_obj], self.names[connection.post_obj])
        slices = (repr(connection.pre_slice), repr(connection.post_slice))
        function = getattr(connection.function, "__qualname__", "")
        init = np.asarray(getattr(connection.transform, "init", 0.0))
        return (*ends, *slices, function, init.tobytes().hex())


def build(
    network: nengo.Network,
    names: Names,
    dt_s: float,
    change: Callable[[Model], Any] = lambda model: None,
    seeds: Mapping[Any, int] = MappingProxyType({}),
) -> Blocks:
    """Build and discretise a network.

    Parameters
    ----------
    network : nengo.Network
        The network; a seed of 0 stands in where it has none.
    names : Names
        The names of its objects.
    dt_s : float
        The time step, in seconds.
    change : callable
        Called with the model of float blocks, which it may change, before they are discretised.
    seeds : mapping of Nengo objects to int
        Seeds of objects that are not to be seeded by their place in the network.

    Raises
    ------
    RefusedError
        If nengo-loihi's builder refuses the network for a reason `lint` does not know.
    """
    model = OrderedModel(dt_s, names)
    model.seeds.update({network: network.seed or 0, **seeds})
    model.seeded[network] = True
    with collected_warnings() as collected, numpy1_semantics():
        try:
            model.build(network, precompute=False, discretize=False)
        except Exception as error:  # it refuses by errors of any kind, not only by its own
            raise refused_or_not_finite(model.building, error) from error
        change(model)
        labels = dict(_labels(model, names))
        _check_probed_nodes(network, model, names)
        _check_order_of_reads(model, names)
        _check_population_axons(model, labels)
        floats = discretise(model, labels)
    errors = tuple(block_error(labels[b], floats[b], b) for b in model.blocks)
    said = {without_addresses(one.message) for one in collected}
    return Blocks(model, labels, errors, tuple(sorted(said)), floats)


def _check_probed_nodes(network: nengo.Network, model: Model, names: Names) -> None:
    """Of a cluster of passthrough nodes, nengo-loihi forgets those that lead nowhere."""
    removed, added = model.split.passthrough.to_remove, model.split.passthrough.to_add
    fed = {connection.post_obj for connection in {*network.all_connections, *added} - removed}
    lost = {connection.post_obj for connection in removed & {*network.all_connections}} - fed
    for probe in network.all_probes:
        if probe.obj in lost:
            raise RefusedError(
                f"{names[probe.obj]}: nengo-loihi removes what feeds this passthrough node, and "
                "its probe would read zeros; cure: give it a function, as in "
                "nengo.Node(lambda t, x: x, size_in=...)"
            )


def _check_order_of_reads(model: Model, names: Names) -> None:
    """nengo-loihi mixes up the neurons of split ensembles unless they are read in order."""
    for probe in model.nengo_probes:
        if not isinstance(probe.obj, Neurons):
            continue
        read = np.arange(probe.obj.size_out)[probe.slice]
        blocks = len(model.objs[probe]["out"].target)
        if blocks > 1 and np.any(np.diff(read) <= 0):
            raise RefusedError(
                f"{names[probe.obj]}: its neurons are read out in another order than theirs, which "
                "fails where they are split over several cores; cure: read them in ascending order"
            )


def _check_population_axons(model: Model, labels: dict[Any, str]) -> None:
    """Axons of population type 16 address every fourth compartment."""
    for block in model.blocks:
        for synapse in block.synapses:
            bases = np.asarray(synapse.axon_compartment_bases)
            if synapse.pop_type == 16 and np.any(bases[bases >= 0] % 4):
                raise RefusedError(
                    f"{labels[block]}: axons of population type 16 start at compartments that are "
                    "not multiples of 4; cure: use pop_type 32, or channels_last=True with a "
                    "multiple of 4 filters, also in each block"
                )


def _seed_from(name: str) -> int:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "little") % SEED_LIMIT


def _labels(model: Model, names: Names) -> Iterator[tuple[Any, str]]:
    """Readable names of blocks: an ensemble's, or a connection's for the neurons that relay it."""
    for obj, parts in model.objs.items():
        if isinstance(obj, nengo.Ensemble):
            yield from _pieces(parts["out"], names[obj])
        elif isinstance(obj, nengo.Connection) and "decoded" in parts:
            yield from _pieces(parts["decoded"], names[obj])


def _pieces(blocks: Any, name: str) -> Iterator[tuple[LoihiBlock, str]]:
    blocks = blocks if isinstance(blocks, list) else [blocks]
    for i, block in enumerate(blocks):
        yield block, name if len(blocks) == 1 else f"{name}[{i + 1}/{len(blocks)}]"
