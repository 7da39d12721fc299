"""Pickles as data: a reader that makes plain values, and calls only functions with known names.

Python's own unpickler looks names up and calls them, and five bytes may make it allocate 16 GB. So
this module executes the instructions itself. A name in a file that is not known is refused.
"""

import pickletools
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import BinaryIO

from spikeport.networks.loading.refusal import EXPORT
from spikeport.reading.mismatch import MismatchError, first_line

LONGEST_NAME = 1_000
"""Letters of a name, which a file may put together as often as it has instructions."""
INSTRUCTIONS = 500_000
"""The most instructions of a pickle: a checkpoint of a hundred layers has a tenth.

An attribute that is copied to a module counts as one: many modules may share one dictionary.
"""

PLAIN = "tensors and plain values"

Persistent = Callable[[object], object]
"""A function that resolves a persistent identifier: in torch's files, to a storage of numbers."""


@dataclass(frozen=True)
class Known:
    """A name that a pickle may contain, with the function that replaces a call of it."""

    make: Callable[..., object]


@dataclass(eq=False)
class Module:
    """A module of TorchScript: the name of its class, and its attributes by name."""

    kind: str
    attributes: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class ModuleClass:
    """The class of a `Module`."""

    name: str


Names = Callable[[str], object]
"""A function that resolves a dotted name to something `Known`, a `ModuleClass`, or a plain value.

It raises `MismatchError` for any other name.
"""


def load(stream: BinaryIO, names: Names, persistent: Persistent) -> object:
    """Return the value of a pickle, and leave the stream at the pickle's end.

    Raises
    ------
    MismatchError
        The pickle is damaged, too long, or has values that are neither plain nor known to `names`.
    """
    machine = _Machine(names, persistent)
    try:
        for instruction, argument, _ in pickletools.genops(stream):
            machine.spend()
            if instruction.name == "STOP":
                return machine.stack.pop()
            machine.carry_out(instruction.name, argument)
    except (ValueError, TypeError, KeyError, IndexError, struct.error) as error:
        raise MismatchError("a whole pickle", f"a damaged one ({first_line(error)})") from error
    raise MismatchError("a whole pickle", "one without an end")


class _Machine:
    """The stack machine of a pickle; `_below` keeps the values under each mark."""

    def __init__(self, names: Names, persistent: Persistent) -> None:
        self.stack: list[object] = []
        self._below: list[list[object]] = []
        self._memo: dict[object, object] = {}
        self._names, self._persistent = names, persistent
        self._left = INSTRUCTIONS

    def spend(self, instructions: int = 1) -> None:
        self._left -= instructions
        if self._left < 0:
            raise MismatchError(
                f"a pickle of at most {INSTRUCTIONS:,} instructions", "a longer one"
            )

    def carry_out(self, name: str, argument: object) -> None:
        if name in VALUES:
            self.stack.append(argument)
        elif name in CONSTANTS:
            self.stack.append(CONSTANTS[name]())
        elif name in PUTS:
            self._memo[argument] = self.stack[-1]
        elif name in GETS:
            self.stack.append(self._memo[argument])
        elif name in INSTRUCTIONS_BY_NAME:
            INSTRUCTIONS_BY_NAME[name](self, argument)
        elif name not in NOTHING:
            raise MismatchError(PLAIN, f"a pickle with {name}")

    def memoize(self, _: object) -> None:
        self._memo[len(self._memo)] = self.stack[-1]

    def mark(self, _: object) -> None:
        self._below.append(self.stack)
        self.stack = []

    def to_mark(self) -> list[object]:
        values, self.stack = self.stack, self._below.pop()
        return values

    def taken(self, count: int) -> tuple[object, ...]:
        if len(self.stack) < count:
            raise IndexError("values are missing")
        values = tuple(self.stack[-count:])
        del self.stack[-count:]
        return values

    def tuple_to_mark(self, _: object) -> None:
        values = tuple(self.to_mark())  # first, since it replaces the stack
        self.stack.append(values)

    def named(self, name: object) -> None:
        self.stack.append(self._names(str(name).replace(" ", ".")))

    def named_on_stack(self, _: object) -> None:
        match self.taken(2):
            # other values are not printed: they may be nested too deeply, or endless texts
            case (str(module), str(name)) if len(module) + len(name) <= LONGEST_NAME:
                self.named(f"{module} {name}")
            case _:
                raise TypeError("a name that is not text, or too long")

    def persistent(self, _: object) -> None:
        self.stack.append(self._persistent(self.stack.pop()))

    def call(self, _: object) -> None:
        called, arguments = self.taken(2)
        if not isinstance(called, Known) or not isinstance(arguments, tuple):
            raise MismatchError(PLAIN, f"a call of {type(called).__name__}")
        self.stack.append(called.make(*arguments))

    def new(self, _: object) -> None:
        made, arguments = self.taken(2)
        if not isinstance(made, ModuleClass) or arguments != ():
            raise MismatchError(PLAIN, f"an object of {type(made).__name__}")
        self.stack.append(Module(made.name))

    def build(self, _: object) -> None:
        (state,) = self.taken(1)
        match self.stack[-1], state:
            case Module() as module, dict():
                # One instruction copies the whole dictionary, so each item counts as one.
                self.spend(len(state))
                module.attributes.update({str(name): value for name, value in state.items()})
            case dict(), _:  # an ordered dictionary's attributes: versions of torch modules
                pass
            case Module() as module, _:
                found = f"{module.kind}, whose own code restores its state"
                raise MismatchError("a module without code for loading", found, cure=EXPORT)
            case other, _:
                raise MismatchError(PLAIN, f"a state of {type(other).__name__}")

    def append(self, _: object) -> None:
        (value,) = self.taken(1)
        self._extend([value])

    def appends(self, _: object) -> None:
        self._extend(self.to_mark())

    def _extend(self, values: list[object]) -> None:
        if not isinstance(self.stack[-1], list):
            raise TypeError("values are appended to something other than a list")
        self.stack[-1].extend(values)

    def set_item(self, _: object) -> None:
        self._update(list(self.taken(2)))

    def set_items(self, _: object) -> None:
        self._update(self.to_mark())

    def _update(self, values: list[object]) -> None:
        target = self.stack[-1]
        if not isinstance(target, dict):
            raise TypeError("items are set in something other than a dictionary")
        for key, value in zip(values[::2], values[1::2], strict=True):
            # hashing a deep tuple crashes Python, and a very long number cannot be printed
            if not isinstance(key, str | int | float | None) or _is_long(key):
                raise MismatchError("keys that are plain values", type(key).__name__)
            target[key] = value


def _is_long(value: object) -> bool:
    return isinstance(value, int) and not -(2**63) <= value < 2**63


VALUES = frozenset(
    {"BININT", "BININT1", "BININT2", "LONG1", "LONG4", "BINFLOAT"}
    | {"BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8", "SHORT_BINBYTES", "BINBYTES", "BINBYTES8"}
)
CONSTANTS: Mapping[str, Callable[[], object]] = {
    "NONE": lambda: None,
    "NEWTRUE": lambda: True,
    "NEWFALSE": lambda: False,
    "EMPTY_TUPLE": tuple,
    "EMPTY_LIST": list,
    "EMPTY_DICT": dict,
}
PUTS = frozenset({"BINPUT", "LONG_BINPUT"})
GETS = frozenset({"BINGET", "LONG_BINGET"})
NOTHING = frozenset({"PROTO", "FRAME"})
INSTRUCTIONS_BY_NAME: Mapping[str, Callable[[_Machine, object], None]] = {
    "MEMOIZE": _Machine.memoize,
    "MARK": _Machine.mark,
    "TUPLE": _Machine.tuple_to_mark,
    "TUPLE1": lambda machine, _: machine.stack.append(machine.taken(1)),
    "TUPLE2": lambda machine, _: machine.stack.append(machine.taken(2)),
    "TUPLE3": lambda machine, _: machine.stack.append(machine.taken(3)),
    "GLOBAL": _Machine.named,
    "STACK_GLOBAL": _Machine.named_on_stack,
    "BINPERSID": _Machine.persistent,
    "REDUCE": _Machine.call,
    "NEWOBJ": _Machine.new,
    "BUILD": _Machine.build,
    "APPEND": _Machine.append,
    "APPENDS": _Machine.appends,
    "SETITEM": _Machine.set_item,
    "SETITEMS": _Machine.set_items,
}
