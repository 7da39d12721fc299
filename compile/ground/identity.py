"""The identity of a network: everything in it that decides the result of a compile, as plain data.

Objects are numbered in the order of definition, and refer to each other by number. Functions of
nodes, and of connections from nodes, are called while the network runs: they decide nothing and are
left out. Functions of other connections are included. The identity also records which objects share
a function, since a cached compile refers to functions by object.
"""

import functools
import marshal
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import nengo
import numpy as np
import scipy.sparse
from nengo.base import NengoObject, ObjView
from nengo.config import ClassParams
from nengo.connection import LearningRule
from nengo.ensemble import Neurons
from nengo.params import FrozenObject, iter_params
from nengo.rc import rc

from spikeport.compile.ground.refusal import without_addresses
from spikeport.compile.ground.settings import add_params
from spikeport.function_identity import FunctionIdentity

BUILT_IN = (type(None), bool, int, float, str, bytes)
PLAIN_PYTHON = ("nengo", "nengo_loihi", "spikeport")
"""Packages whose objects keep their state in attributes that can be read."""
ARRAYS = (np.ndarray, np.memmap, np.matrix, np.recarray)
"""Types of arrays that consist of their values alone. A masked array also has a mask, and an array
of a user's class has methods."""
OF_NETWORK = (nengo.Network, NengoObject, ObjView, Neurons, LearningRule)
"""Types of networks, and of their objects and parts."""
NO_FUNCTIONS = (np.ndarray, FrozenObject, *OF_NETWORK)
"""Types of the most frequent values that are neither built in nor functions."""
LATER = "called while the network runs"


def identity(network: nengo.Network) -> bytes:
    """Return the identity of a network.

    Raises
    ------
    TypeError
        If a part of the network has no identity that lasts; the message names part and object.
    """
    # Version 2 has no references between parts, so that the bytes depend on values alone.
    return marshal.dumps(_Identity(network).whole(), 2)


class _Identity:
    def __init__(self, network: nengo.Network) -> None:
        self._objects = list(_members(network))
        self._number = {id(obj): number for number, obj in enumerate(self._objects)}
        self._owner: dict[int, int] = {}
        """The number of the first object that has a function, by the function's ``id``."""
        for number, obj in enumerate(self._objects):
            if isinstance(obj, nengo.Node | nengo.Connection):
                self._owner.setdefault(id(_function_of(obj)), number)
        self._parameters_of: dict[type, list[str]] = {}
        self._frozen: dict[int, tuple[FrozenObject, object]] = {}

    def whole(self) -> Any:
        # Nengo builds with the types in its settings, and they change the result.
        bits = [rc.float_dtype.str, rc.int_dtype.str]
        return bits, [self._member(obj) for obj in self._objects]

    def _member(self, obj: NengoObject | nengo.Network) -> object:
        try:
            if isinstance(obj, nengo.Network):
                return self._net(obj)
            return [type(obj).__name__, *self._parameters(obj)]
        except TypeError as error:
            raise TypeError(f"{without_addresses(str(obj))}: {error}") from error

    def _net(self, network: nengo.Network) -> object:
        sizes = [len(getattr(network, kind)) for kind in KINDS]
        return ["Network", sizes, network.label, network.seed, list(self._config(network))]

    def _config(self, network: nengo.Network) -> Iterator[object]:
        """Yield the settings in a network's config, of classes and of single objects."""
        of_objects = []
        for key, settings in network.config.params.items():
            if isinstance(key, type):
                yield key.__name__, self._settings(settings, _names(key, settings))
            elif id(key) in self._number:
                known = settings._clsparams
                # Only values that were set for this object: it has the others from its class, and
                # they are yielded above.
                own = [name for name in known.extra_params if settings in known.get_param(name)]
                if own:
                    of_objects.append((self._number[id(key)], self._settings(settings, own)))
        # Sorted by number, since the dict has objects in the order of their configuration.
        yield sorted(of_objects, key=lambda one: one[0])

    def _settings(self, settings: object, names: Iterable[str]) -> object:
        return [(name, self._value(getattr(settings, name))) for name in names]

    def _parameters(self, obj: NengoObject) -> Iterator[object]:
        kind = type(obj)
        if kind not in self._parameters_of:
            self._parameters_of[kind] = list(iter_params(kind))
        for name in self._parameters_of[kind]:
            if name == "output" and callable(output := getattr(obj, name)):
                is_process = isinstance(output, nengo.Process)
                yield name, self._value(output) if is_process else self._later(output)
            elif name == "function_info":
                yield name, self._function(obj)
            else:
                yield name, self._value(getattr(obj, name))

    def _function(self, connection: nengo.Connection) -> object:
        """Return the identity of a connection's function; functions of nodes' values run later."""
        function, size = connection.function, connection.size_mid
        if not callable(function):
            return self._value(function), size
        on_host = isinstance(connection.pre_obj, nengo.Node)
        return None if on_host else self._value(function), self._later(function), size

    def _later(self, function: object) -> object:
        """Return a stand-in for a function that is called later: the first object that has it."""
        # Hints know the values of some of NumPy's functions (SP421).
        name = function.__name__ if isinstance(function, np.ufunc) else ""
        return LATER, self._owner[id(function)], name

    def _value(self, value: object) -> object:
        if type(value) in BUILT_IN:  # as most values are
            return value
        if isinstance(value, NO_FUNCTIONS):
            return self._plain(value)
        return FunctionIdentity(self._reached).of(value)

    def _reached(self, value: object) -> object:
        """Return the identity of a value that a function reaches."""
        # Its number does not say what a function reads of an object: an attribute of the user's, or
        # the function of a node, which the identity leaves out.
        if isinstance(value, OF_NETWORK):
            raise TypeError("a function that uses a network's object has no identity that lasts")
        return self._plain(value)

    def _plain(self, value: object) -> object:
        """Return the identity of a value that is not a function."""
        match value:
            case None | bool() | int() | float() | str() | bytes() if type(value) in BUILT_IN:
                return value
            case np.generic() | np.ndarray():
                return self._array(value)
            case slice():
                return "slice", [value.start, value.stop, value.step]
            case np.dtype():
                return "dtype", repr(value)
            case ObjView():
                return "view", self._plain(value.obj), self._value(value.slice)
            case Neurons():
                return "neurons", self._plain(value.ensemble)
            case LearningRule():
                return "rule", self._plain(value.connection), self._value(value.learning_rule_type)
            case NengoObject() | nengo.Network() if id(value) in self._number:
                return "object", self._number[id(value)]
            case _ if scipy.sparse.issparse(value):
                entries = scipy.sparse.coo_array(value)
                parts = map(self._array, (entries.row, entries.col, entries.data))
                return type(value).__name__, list(entries.shape), *parts
        if type(value).__module__.partition(".")[0] not in PLAIN_PYTHON:
            raise TypeError(f"an object of {type(value).__qualname__} has no identity that lasts")
        if isinstance(value, FrozenObject):  # many objects share one
            if id(value) not in self._frozen:
                self._frozen[id(value)] = value, self._parts(value)
            return self._frozen[id(value)][1]
        return self._parts(value)

    @staticmethod
    def _array(value: np.generic | np.ndarray) -> object:
        if value.dtype.hasobject:
            raise TypeError("an array of Python objects has no identity that lasts")
        kind = type(value)
        if kind not in (*ARRAYS, value.dtype.type):
            raise TypeError(f"an array of {kind.__qualname__} has no identity that lasts")
        # The last bits of products depend on the order in memory. `dtype.str` names no fields.
        return kind.__name__, _repr(value.dtype), value.shape, value.strides, value.tobytes()

    def _parts(self, value: object) -> object:
        kind = f"{type(value).__module__}.{type(value).__qualname__}"
        return kind, [(name, self._value(one)) for name, one in _state(value)]


_repr = functools.cache(repr)
"""Returns the ``repr`` of an array's type, which takes NumPy longer than the rest of an array."""

KINDS = ("ensembles", "nodes", "networks", "connections", "probes")


def _function_of(obj: nengo.Node | nengo.Connection) -> object:
    """Return the output of a node or the function of a connection, which may be no function."""
    return obj.output if isinstance(obj, nengo.Node) else obj.function


def _names(kind: type, settings: ClassParams) -> list[str]:
    """Return the settings of a class, except settings that a compile adds and nobody changed."""
    added = _added().get(kind, {})
    return [
        name
        for name in settings.params
        if name not in added or getattr(settings, name) != added[name]
    ]


@functools.cache
def _added() -> dict[type, dict[str, object]]:
    """Return the settings that a compile adds to classes, with their defaults."""
    network = nengo.Network(add_to_container=False)
    add_params(network)
    of_class = {kind: network.config[kind] for kind in (nengo.Ensemble, nengo.Connection)}
    return {
        kind: {name: getattr(settings, name) for name in settings.extra_params}
        for kind, settings in of_class.items()
    }


def _members(network: nengo.Network) -> Iterator[NengoObject | nengo.Network]:
    """Yield a network and all that is in it, in the order of definition."""
    yield network
    for kind in KINDS:
        for obj in getattr(network, kind):
            yield from _members(obj) if isinstance(obj, nengo.Network) else [obj]


def _state(value: object) -> list[tuple[str, object]]:
    """Return the parts of an object by name."""
    if isinstance(value, FrozenObject):
        state = {name: getattr(value, name) for name in value._paramdict}
        own = vars(value).items()
        return sorted(
            {**state, **{name: one for name, one in own if name not in OF_FROZEN}}.items()
        )
    if is_dataclass(value):
        return [(one.name, getattr(value, one.name)) for one in fields(value)]
    if hasattr(value, "__dict__"):
        return sorted(vars(value).items())
    raise TypeError(f"an object of {type(value).__qualname__} has no identity that lasts")


OF_FROZEN = ("_paramdict", "_FrozenObject__argreprs")
"""Attributes of Nengo's frozen objects that are not parameters and decide nothing."""
