"""Values of a compile as plain data and arrays for a cache, and back.

Only the kinds of values below are written and read, each by its own rule. A cache entry can
therefore create no other objects, and call no functions.

    plain data     JSON
    arrays         end to end in one array of bytes, by number
    objects        the fields of NamedTuples and dataclasses of spikeport, the parameters of
                   Nengo's frozen objects (synapses, neuron types, distributions)
    references     the user's own objects and functions, by their number in the user's network
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, Literal, TypeAlias

import numpy as np
from nengo.params import FrozenObject

from spikeport.cache import Arrays
from spikeport.reading.mismatch import MismatchError

Tree: TypeAlias = Any
"""Plain data, ready for JSON."""
TUPLES = ("spikeport.compile.", "spikeport.hardware_models.")
FROZEN = ("nengo.synapses", "nengo.neurons", "nengo.dists")
ALIGNMENT = 64
KINDS = "biufc"
"""Kinds of arrays, by NumPy's letters: only numbers, for which any bytes are a valid value."""


class NotKeptError(TypeError):
    """The error of a value that cannot be kept in a cache."""


class Writer:
    """Writer of values as trees; an array that occurs several times is written once.

    Parameters
    ----------
    references : mapping of int to a tree
        The trees that stand for objects that are not written, by ``id``.
    """

    def __init__(self, references: Mapping[int, Tree]) -> None:
        self._references = references
        self._numbers: dict[int, int] = {}
        self._arrays: list[np.ndarray] = []

    def write(self, value: object) -> Tree:
        """Return a value as plain data.

        Raises
        ------
        NotKeptError
            If there is no rule for a part of it.
        """
        if id(value) in self._references:
            return ["ref", self._references[id(value)]]
        match value:
            case None | bool() | int() | float() | str() if type(value) in PLAIN:
                return value
            case np.ndarray():
                return ["array", self._number(value)]
            case np.generic():
                return ["scalar", self._number(np.asarray(value))]
            case slice():
                return ["slice", value.start, value.stop, value.step]
            case dict():
                return ["dict", [[self.write(k), self.write(v)] for k, v in value.items()]]
        return self._object(value)

    def _object(self, value: object) -> Tree:
        kind = [type(value).__module__, type(value).__qualname__]
        if type(value) in (list, tuple):
            assert isinstance(value, list | tuple)
            return [type(value).__name__, [self.write(one) for one in value]]
        if isinstance(value, tuple) and hasattr(value, "_fields") and _among(kind[0], TUPLES):
            return ["tuple_of", kind, [self.write(one) for one in value]]
        if is_dataclass(value) and _among(kind[0], TUPLES):
            state = {one.name: getattr(value, one.name) for one in fields(value)}
            return ["data", kind, self.write(state)]
        if isinstance(value, FrozenObject) and kind[0] in FROZEN:
            state = {n: s for n, s in value.__getstate__().items() if not n.startswith("_Frozen")}
            return ["frozen", kind, self.write(state)]
        raise NotKeptError(f"an object of {kind[0]}.{kind[1]} cannot be kept in a cache")

    def _number(self, array: np.ndarray) -> int:
        if array.dtype.kind not in KINDS:
            raise NotKeptError(f"an array of {array.dtype} cannot be kept in a cache")
        if id(array) not in self._numbers:
            self._numbers[id(array)] = len(self._arrays)
            self._arrays.append(array)
        return self._numbers[id(array)]

    def arrays(self, tree: Tree) -> dict[str, np.ndarray]:
        """Return a tree and all written arrays as two arrays: JSON, and a pool of bytes."""
        table: list[tuple[str, list[int], str, int]] = []
        start = 0
        for array in self._arrays:
            table.append((array.dtype.str, list(array.shape), _order(array), start))
            start += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
        pool = np.zeros(start, np.uint8)
        for array, (*_, begin) in zip(self._arrays, table, strict=True):
            content = array.tobytes(_order(array))
            pool[begin : begin + array.nbytes] = np.frombuffer(content, np.uint8)
        text = json.dumps([tree, table]).encode()
        return {"tree": np.frombuffer(text, np.uint8), "pool": pool}


class Reader:
    """Reader of the trees and arrays of a `Writer`.

    Parameters
    ----------
    arrays : mapping of str to array
        The arrays that `Writer.arrays` returned.

    Attributes
    ----------
    reference : callable
        Returns the object that the tree of a reference stands for.
    """

    reference: Callable[[Tree], object]

    def __init__(self, arrays: Arrays) -> None:
        self._pool = arrays["pool"]
        self.tree, self._table = json.loads(arrays["tree"].tobytes())
        self._read: dict[int, np.ndarray] = {}

    def read(self, tree: Tree) -> Any:
        """Return the value that was written as a tree.

        Raises
        ------
        MismatchError
            If the tree has no known form.
        """
        if not isinstance(tree, list):
            return tree
        match tree:
            case ["ref", reference]:
                return self.reference(reference)
            case ["array", int(number)]:
                return self._array(number)
            case ["scalar", int(number)]:
                return self._array(number)[()]
            case ["slice", start, stop, step]:
                return slice(start, stop, step)
            case ["dict", pairs]:
                return {self.read(key): self.read(value) for key, value in pairs}
            case ["list", parts]:
                return [self.read(part) for part in parts]
            case ["tuple", parts]:
                return tuple(self.read(part) for part in parts)
            case ["tuple_of", kind, parts]:
                return _class(kind, TUPLES, _is_named_tuple)(*(self.read(part) for part in parts))
            case ["data", kind, state]:
                return self._data(_class(kind, TUPLES, is_dataclass), self.read(state))
            case ["frozen", kind, state]:
                return self._frozen(_class(kind, FROZEN, _is_frozen), self.read(state))
        raise MismatchError("a value that a compile keeps", str(tree)[:80])

    def _array(self, number: int) -> np.ndarray:
        if number not in self._read:
            self._read[number] = self._within_pool(*self._table[number])
        return self._read[number]

    def _within_pool(
        self, letters: str, shape: list[int], order: Literal["F", "C"], start: int
    ) -> np.ndarray:
        dtype = np.dtype(letters)
        end = start + math.prod(shape) * dtype.itemsize
        if dtype.kind not in KINDS or min(shape, default=0) < 0:
            raise MismatchError("an array of numbers", f"one of {shape} values of {dtype}")
        if not 0 <= start <= end <= len(self._pool):
            raise MismatchError(f"bytes up to {len(self._pool):,}", f"{start:,} to {end:,}")
        return self._pool[start:end].view(dtype).reshape(shape, order=order)

    @staticmethod
    def _data(kind: type, state: dict[str, object]) -> object:
        names = [one.name for one in fields(kind)]
        if sorted(state) != sorted(names):
            raise MismatchError(f"fields {', '.join(names)}", ", ".join(map(str, state)))
        made: object = object.__new__(kind)
        for name, value in state.items():
            object.__setattr__(made, name, value)
        return made

    @staticmethod
    def _frozen(kind: type, state: dict[str, object]) -> object:
        made: Any = object.__new__(kind)
        made.__setstate__(state)
        return made


def _order(array: np.ndarray) -> Literal["F", "C"]:
    return "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"


PLAIN = (type(None), bool, int, float, str)


def _among(module: str, known: Sequence[str]) -> bool:
    return any(module == one or (one.endswith(".") and module.startswith(one)) for one in known)


def _class(kind: Sequence[str], known: Sequence[str], allowed: Callable[[type], bool]) -> type:
    """Return a class of an allowed kind that one of the known modules defines."""
    module, name = kind
    found = getattr(import_module(module), name, None) if _among(module, known) else None
    # A module also has names that it imports: refuse classes that it does not define itself.
    if not (isinstance(found, type) and found.__module__ == module and allowed(found)):
        raise MismatchError("a class that a compile keeps", f"{module}.{name}")
    return found


def _is_named_tuple(kind: type) -> bool:
    return issubclass(kind, tuple) and hasattr(kind, "_fields")


def _is_frozen(kind: type) -> bool:
    return issubclass(kind, FrozenObject)
