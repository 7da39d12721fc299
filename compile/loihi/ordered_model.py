"""nengo-loihi's model, built in the same order in every process.

nengo-loihi replaces clusters of passthrough nodes by connections from a set, without seeds. Here
these are sorted by name and seeded, so that one network gives one image.
"""

import contextlib
import hashlib
from collections.abc import Iterable
from typing import TypeAlias

import nengo
import numpy as np
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo_loihi.builder import Model
from nengo_loihi.builder.builder import ValidationLevel
from nengo_loihi.dvs import DVSFileChipProcess
from nengo_loihi.inputs import LoihiInput, SpikeInput
from nengo_loihi.probe import LoihiProbe

from spikeport.compile.ground.filters import sends_spikes, time_constant_s
from spikeport.compile.ground.names import base
from spikeport.compile.ground.notices import warnings_about
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.ground.scope import MATRICES
from spikeport.compile.ground.settings import NetworkSettings
from spikeport.compile.loihi.events import EventSteps, event_steps
from spikeport.compile.loihi.host_neurons import SparseInputNeurons, weighted
from spikeport.compile.loihi.lean import lean, lean_read_out
from spikeport.compile.loihi.relay import RELAYS, fit_range, relayed

SEED_LIMIT = 2**31 - 1
NAMED = (nengo.Ensemble, nengo.Node, nengo.Connection, nengo.Probe)
Crossing: TypeAlias = nengo.Connection | nengo.Probe | nengo.Node


class OrderedModel(Model):
    """nengo-loihi's model, which also remembers which object it builds.

    ``building`` names the object under construction, and its ends, for error messages;
    ``crossings`` maps inputs and probes to the connection, probe or node of the network that made
    them; ``events`` has the spikes of inputs that are read from files; ``target_filters_s`` maps
    connections that end on the chip to the time constant they ask of their target, in seconds.
    """

    def __init__(self, rewrite: Rewrite, dt_s: float) -> None:
        super().__init__(dt=dt_s, label="spikeport")
        self.names = rewrite.names
        self._options = NetworkSettings(rewrite.network)
        self._made_probes = set(rewrite.stand_ins.values())
        self.building: tuple[str, ...] = ("network",)
        self.crossings: dict[LoihiInput | LoihiProbe, Crossing] = {}
        self.events: dict[LoihiInput, EventSteps] = {}
        self.target_filters_s: dict[nengo.Connection, float] = {}
        # Limits are checked by spikeport.compile.check.verify, which reports all of them at once.
        self.validation_level = ValidationLevel.NONE

    def build(self, obj: object, *args: object, **kwargs: object) -> object:
        """Build one object, after sorting the connections that replace passthrough nodes."""
        if isinstance(obj, DVSFileChipProcess):
            return self._add_events(obj)
        if self.split is not None:
            self._order_passthrough()
        if isinstance(obj, nengo.Connection) and obj.learning_rule_type is not None:
            # A read-out that learns stands for this connection of the network.
            self.names.name_as(obj, self.building[0])
        if isinstance(obj, NAMED):
            self.building = self.names.with_ends(obj)
        if self.seeds.get(obj, 0) is None:
            self.seeds[obj] = _seed_from(self.names[obj])
        if isinstance(obj, nengo.Connection) and self._is_error_on_host(obj):
            self._build_error_on_host(obj)
            return None
        return self._build_by_nengo_loihi(obj, *args, **kwargs)

    def _build_by_nengo_loihi(self, obj: object, *args: object, **kwargs: object) -> object:
        """Build one object by nengo-loihi's builder, and correct and note what it adds."""
        n_inputs, n_probes = len(self.inputs), len(self.probes)
        with self._path_context(obj), warnings_about(self.building[0]):
            built = super().build(obj, *args, **kwargs)
            if isinstance(obj, nengo.Connection) and self._ends_on_chip(obj):
                fit_range(self, obj)
                self.target_filters_s[obj] = self._target_filter_s(obj)
            if isinstance(obj, nengo.Connection) and obj.post_obj in self._made_probes:
                lean_read_out(self, obj)
            for probe in list(self.probes)[n_probes:]:
                probe.weights = [_without_factors(weights) for weights in probe.weights]
        if isinstance(obj, NAMED):
            # Builders call each other: the outermost call builds the object of the network.
            crossing = [*list(self.inputs)[n_inputs:], *list(self.probes)[n_probes:]]
            self.crossings.update(dict.fromkeys(crossing, obj))
        return built

    def failed_at(self, nodes: Iterable[nengo.Node]) -> None:
        """Name one of some nodes in the error that follows."""
        self.building = min(map(self.names.with_ends, nodes))

    def _add_events(self, process: DVSFileChipProcess) -> SpikeInput:
        source = SpikeInput(process.size, label=self.building[0])
        self.add_input(source)
        self.events[source] = event_steps(process, self.dt)
        return source

    def _ends_on_chip(self, connection: nengo.Connection) -> bool:
        post = base(connection.post_obj)  # of a learning rule, the connection that learns
        return isinstance(post, nengo.Ensemble) and self.split.on_chip(post)

    def _target_filter_s(self, connection: nengo.Connection) -> float:
        """Return the time constant that a connection under construction asks of its target."""
        from_chip = self.split.on_chip(base(connection.pre_obj))
        relayed = from_chip and "decoded" in self.objs[connection]
        values = relayed or not sends_spikes(connection, from_chip)
        return float(self.decode_tau) if values else time_constant_s(connection)

    def _is_error_on_host(self, connection: nengo.Connection) -> bool:
        """Return whether a connection sends an error to a connection that starts on the host."""
        if not isinstance(connection.post_obj, LearningRule):
            return False
        return not self.split.on_chip(base(connection.post_obj.connection.pre_obj))

    def _build_error_on_host(self, connection: nengo.Connection) -> None:
        """Build a connection to a learning rule that Nengo computes on the host.

        nengo-loihi looks for the rule on the chip only, and finds none.
        """
        host = self.host_model(base(connection.pre_obj))
        host.seeds[connection] = self.seeds[connection]
        host.seeded[connection] = self.seeded[connection]
        host.build(connection)

    def _path_context(self, obj: object) -> contextlib.ExitStack[bool | None]:
        """Return a context for the path that the network's config asks for, if any."""
        stack = contextlib.ExitStack()
        if isinstance(obj, nengo.Connection):
            path = self._options.get(obj, "decode_path")
            on_chip = self._ends_on_chip(obj)
            if path in RELAYS and on_chip:
                from_chip = self.split.on_chip(base(obj.pre_obj))
                after_s = self._options.get(obj, "target_filter_s") if from_chip else None
                stack.enter_context(relayed(self, obj, path, after_s))
            lines = isinstance(obj.post_obj, Neurons) and isinstance(obj.transform, MATRICES)
            if path == "direct" and on_chip and lines:
                stack.enter_context(lean(self, obj))
            if self._is_sparse_input(obj):
                stack.enter_context(weighted(self, obj))
        return stack

    def _is_sparse_input(self, connection: nengo.Connection) -> bool:
        """Return whether host neurons that are silent at zero send a connection's values."""
        sparse = isinstance(self.node_neurons, SparseInputNeurons)
        from_host = not self.split.on_chip(base(connection.pre_obj))
        return sparse and from_host and self._ends_on_chip(connection)

    def _order_passthrough(self) -> None:
        passthrough = self.split.passthrough
        # Sorted once: a second call finds the list.
        if isinstance(passthrough.to_add, set):
            functions = [id(c.function) for c in self.split.network.all_connections]
            first = {function: n for n, function in reversed(list(enumerate(functions)))}
            # Functions are sorted by their first connection, since their names may be equal.
            passthrough.to_add = sorted(
                passthrough.to_add,
                key=lambda c: (self._sort_key(c), first.get(id(c.function), len(first))),
            )

    def _sort_key(self, connection: nengo.Connection) -> tuple[str, ...]:
        pre, post, function = connection.pre_obj, connection.post_obj, connection.function
        ends, kinds = (self.names[pre], self.names[post]), (type(pre).__name__, type(post).__name__)
        slices = (repr(connection.pre_slice), repr(connection.post_slice))
        init = np.asarray(getattr(connection.transform, "init", 0.0))
        points = function if isinstance(function, np.ndarray) else None
        solver, decoders = connection.solver, getattr(connection.solver, "values", None)
        more = (connection.synapse, connection.eval_points, connection.scale_eval_points, points)
        # Everything except functions by which two connections between the same ends can differ, as
        # text that sorts. The last entries only break ties; they were added later, and come last so
        # that images keep their order.
        return (
            *(*ends, *slices, getattr(function, "__qualname__", ""), init.tobytes().hex()),
            *(*kinds, *map(_as_text, (*more, solver, decoders))),
        )


def _without_factors(weights: np.ndarray | None) -> np.ndarray | None:
    """Return the weights of a read-out with a matrix in place of a factor for each of its values.

    nengo-loihi keeps the factors of ``transform=[1, 2, 3]``; an image has a matrix or one factor.
    """
    if weights is None or weights.ndim != 1 or weights.size == 1:
        return weights
    return np.diag(weights).T  # in nengo-loihi's order in memory, on which rounding depends


def _as_text(value: object) -> str:
    return value.tobytes().hex() if isinstance(value, np.ndarray) else repr(value)


def _seed_from(name: str) -> int:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "little") % SEED_LIMIT
