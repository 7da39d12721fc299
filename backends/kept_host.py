"""The host's part of a compiled network as plain data and arrays, and back.

Nengo's operators are kept by their signals and constants. Functions and processes of the user's
nodes and connections, and probes, are not kept: they are taken, by number, from the network of the
new run. A network with an operator that is not in `OPERATORS` is not kept, but compiled each time.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import nengo
import numpy as np
from nengo.base import NengoObject
from nengo.builder import Model
from nengo.builder import neurons as neuron_operators
from nengo.builder import operator as operators
from nengo.builder import processes as process_operators
from nengo.builder.probe import SimProbe
from nengo.builder.signal import Signal

from spikeport.backends.host_program import HostPort, HostProgram
from spikeport.backends.kept_values import NotKeptError, Reader, Tree, Writer
from spikeport.compile.ground.scope import same

OPERATORS: dict[str, type[operators.Operator]] = {
    kind.__name__: kind
    for kind in (
        operators.TimeUpdate,
        operators.Reset,
        operators.Copy,
        operators.ElementwiseInc,
        operators.DotInc,
        operators.SimPyFunc,
        neuron_operators.SimNeurons,
        process_operators.SimProcess,
        SimProbe,
    )
}


class Edge(nengo.Process):
    """A process where values enter or leave the host: a backend replaces it by memory.

    It stands for nengo-loihi's own process, and computes nothing.
    """

    def make_step(self, shape_in, shape_out, dt, rng, state):  # type: ignore[no-untyped-def]
        """Return a step that does nothing."""
        return lambda *_: None if shape_out == (0,) else np.zeros(shape_out)


class UsersObjects:
    """The objects and functions of a network, by number; equal networks have equal numbers."""

    def __init__(self, network: nengo.Network) -> None:
        self.objects: list[NengoObject] = list(network.all_objects)
        # Passes put nodes of their own between the user's.
        self.called = [*_called(network), same]

    def references(self) -> dict[int, Tree]:
        """Return the references that stand for the objects and functions, by ``id``."""
        objects = {id(obj): ["object", n] for n, obj in enumerate(self.objects)}
        return {**{id(one): ["called", n] for n, one in enumerate(self.called)}, **objects}

    def find(self, reference: Tree) -> object:
        """Return the object or function that a reference stands for."""
        kind, number = reference
        return {"object": self.objects, "called": self.called}[kind][number]


def _called(network: nengo.Network) -> Iterator[object]:
    """Yield the functions and processes that are called while a network runs."""
    for node in network.all_nodes:
        if callable(node.output) or isinstance(node.output, nengo.Process):
            yield node.output
    for connection in network.all_connections:
        if isinstance(connection.pre_obj, nengo.Node) and callable(connection.function):
            yield connection.function


class HostWriter:
    """Writer of the host's part of a compilation, with a `Writer` of values."""

    def __init__(self, users: UsersObjects, program: HostProgram) -> None:
        self._users = users
        self._edges = edges_of(program)
        ports = {id(process): ["edge", n] for n, process in enumerate(self._edges)}
        self.values = Writer({**users.references(), **ports})
        self._program = program
        self._signals: dict[int, int] = {}
        self._trees: list[Tree] = []
        self._kept: list[Signal] = []

    def program(self, stand_ins: Mapping[nengo.Probe, nengo.Probe]) -> Tree:
        """Return a host program as plain data, and the recordings of the user's probes."""
        model, program = self._program.model, self._program
        recorded, on_host = self._recordings(stand_ins)
        return {
            "operators": [self._operator(one) for one in model.operators],
            "step": self._signal(model.step),
            "time": self._signal(model.time),
            "probes": on_host,
            "recorded": recorded,
            "senders": [_port(one) for one in program.senders],
            "errors": [_port(one) for one in program.error_senders],
            "receivers": [output for output, _ in program.receivers],
            "signals": self._trees,
            "dt_s": model.dt,
        }

    def _recordings(
        self, stand_ins: Mapping[nengo.Probe, nengo.Probe]
    ) -> tuple[list[Tree], list[Tree]]:
        """Return the user's probes with what each records: an output of the chip, or a signal."""
        model, program = self._program.model, self._program
        probes = [one for one in self._users.objects if isinstance(one, nengo.Probe)]
        recorded: list[Tree] = []
        on_host: list[Tree] = []
        for probe in probes:
            now = stand_ins.get(probe, probe)
            # A pass may replace a probe; a replacement with another filter would change the data.
            if (now.synapse, now.sample_every) != (probe.synapse, probe.sample_every):
                raise NotKeptError(
                    f"{probe}: a pass replaced it with a probe of another filter or sampling "
                    "interval"
                )
            if now in program.probes:
                recorded.append([self.values.write(probe), program.probes[now]])
            elif now in model.probes:
                on_host.append([self.values.write(probe), self._signal(model.sig[now]["in"])])
        if len(on_host) != len(model.probes):
            raise NotKeptError("the host has a recording that belongs to no probe of the network")
        return recorded, on_host

    def _operator(self, op: operators.Operator) -> Tree:
        name = type(op).__name__
        # Compare classes, not names alone: a user's operator may have the name of one of Nengo's.
        if OPERATORS.get(name) is not type(op):
            raise NotKeptError(f"the host computes {name}, which cannot be kept in a cache")
        state = {}
        for key, value in vars(op).items():
            if key in SIGNALS:
                state[key] = [self._signal(one) for one in value]
            elif name == "SimPyFunc" and key == "fn":
                state[key] = self._function(value)
            else:
                state[key] = self.values.write(value)
        return [name, state]

    def _function(self, function: object) -> Tree:
        written = self.values.write(function)
        if not isinstance(written, list) or written[0] != "ref":
            raise NotKeptError(f"the host calls {function!r}, which is not part of the network")
        return written

    def _signal(self, signal: Signal) -> int:
        """Return the number of a signal."""
        if id(signal) in self._signals:
            return self._signals[id(signal)]
        if signal.sparse:
            raise NotKeptError("the host has a sparse matrix, which cannot be kept in a cache")
        base = self._signal(signal.base) if signal.is_view else None
        self._signals[id(signal)] = number = len(self._trees)
        # Keep the signal alive: another object could get the `id` of a freed one.
        self._kept.append(signal)
        about = [signal._name, signal.readonly]
        if base is None:
            self._trees.append(["base", *about, self.values.write(signal.initial_value)])
        else:
            shape, strides = list(signal.shape), list(signal.strides)
            place = [base, signal.offset, signal.dtype.str, shape, strides]
            self._trees.append(["view", *about, *place])
        return number


SIGNALS = ("_sets", "_incs", "_reads", "_updates")


def edges_of(program: HostProgram) -> list[nengo.Process]:
    """Return the processes at the edge of a host: senders, then errors, then receivers."""
    ports = [port.process for port in (*program.senders, *program.error_senders)]
    return [*ports, *(process for _, process in program.receivers)]


def _port(port: HostPort) -> Tree:
    return [port.size, port.target]


class HostReader:
    """Reader of the trees of a `HostWriter`, for a network equal to the one that was kept."""

    def __init__(self, reader: Reader, tree: Tree, users: UsersObjects) -> None:
        self._reader, self._tree, self._users = reader, tree, users
        ends = (*tree["senders"], *tree["errors"], *tree["receivers"])
        self._edges = [Edge() for _ in ends]
        reader.reference = self._find
        self._signals: list[Signal] = []
        kinds: dict[str, Callable[..., Signal]] = {"base": self._base, "view": self._view}
        for kind, *about in tree["signals"]:
            self._signals.append(kinds[kind](*about))

    def _find(self, reference: Tree) -> object:
        kind, number = reference
        return self._edges[number] if kind == "edge" else self._users.find(reference)

    def program(self) -> HostProgram:
        """Return the host program."""
        tree, model = self._tree, Model(dt=self._tree["dt_s"], label="spikeport")
        model.step, model.time = (self._signals[tree[name]] for name in ("step", "time"))
        model.operators = [self._operator(*one) for one in tree["operators"]]
        for written, number in tree["probes"]:
            probe = self._reader.read(written)
            model.probes.append(probe)
            model.sig[probe]["in"] = self._signals[number]
            model.params[probe] = []
        edges = iter(self._edges)
        senders, errors = (
            tuple(HostPort(next(edges), *port) for port in tree[kind])
            for kind in ("senders", "errors")
        )
        receivers = tuple((output, next(edges)) for output in tree["receivers"])
        probes = {self._reader.read(written): output for written, output in tree["recorded"]}
        return HostProgram(model, senders, errors, receivers, probes)

    def _operator(self, name: str, state: dict[str, Tree]) -> operators.Operator:
        # Skip the constructor: some constructors check or compute what is restored here.
        made: operators.Operator = object.__new__(OPERATORS[name])
        for key, value in state.items():
            found = (
                [self._signals[n] for n in value] if key in SIGNALS else self._reader.read(value)
            )
            setattr(made, key, found)
        return made

    def _base(self, name: str | None, readonly: bool, values: Tree) -> Signal:
        # An array of several signals is kept once, but a run must not write to shared memory.
        return Signal(self._reader.read(values).copy(), name=name, readonly=readonly)

    def _view(
        self,
        name: str | None,
        readonly: bool,
        base: int,
        offset: int,
        dtype: str,
        shape: Sequence[int],
        strides: Sequence[int],
    ) -> Signal:
        """Return a signal that shares the memory of its base."""
        whole = self._signals[base]
        view: np.ndarray = np.ndarray(
            shape, np.dtype(dtype), whole.initial_value, offset=offset, strides=strides
        )
        made = Signal(view.copy(), name=name, readonly=readonly, offset=offset)
        made._initial_value, made._base = view, whole
        return made
