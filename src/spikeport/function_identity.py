"""The identity of a function: data on everything that decides its result, equal in every process.

A function has an identity if its code, and everything that it reaches, can be read: values it
closes over, its defaults, and names of its module, recursively. Code of spikeport, of the packages
that `spikeport.cache.surroundings` covers and of modules of Python that only compute is named, and
not read; in SciPy and Nengo only the parts that are known to compute alone count as such. A
function that may read a file, a clock or random numbers has no identity.
"""

import builtins
import dis
import functools
from collections import defaultdict
from collections.abc import Callable, Iterator
from importlib import import_module
from types import BuiltinFunctionType, CellType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any, TypeAlias

import numpy as np

from spikeport.cache import COMPUTING

COVERED = {name.replace("-", "_") for name in COMPUTING} | {"spikeport"}
"""Packages whose code does not change while the surroundings of a result stay the same."""

PURE = {
    *("builtins", "math", "cmath", "operator", "_operator", "itertools", "functools", "_functools"),
    *("statistics", "fractions", "decimal", "numbers", "collections", "bisect", "_bisect", "copy"),
    *("heapq", "_heapq", "string", "re", "enum", "typing", "dataclasses", "abc", "types"),
}
"""Modules of Python whose content is the same in every process, except for `UNSTABLE`."""

PARTS = {
    "scipy": (
        *("_lib", "constants", "differentiate", "fft", "integrate", "interpolate", "linalg"),
        *("ndimage", "signal", "sparse", "spatial", "special"),
    ),
    "nengo": ("exceptions", "networks", "neurons", "synapses"),
}
"""The parts of packages that only compute; other parts read files, or draw random numbers."""

OUTSIDE = ("numpy.random", "scipy.sparse.linalg", "scipy.linalg.interpolative")
"""Modules that draw random numbers, even if only to start from."""

UNSTABLE = {
    *("open", "input", "exec", "eval", "globals", "environ", "getenv", "time"),
    *("__import__", "compile", "getattr", "hash", "id", "locals", "vars"),
    *("load", "loadtxt", "genfromtxt", "fromfile", "fromregex", "memmap", "open_memmap"),
    *("loadmat", "loadarff", "whosmat", "mmread", "mminfo", "fread"),
    *("clarkson_woodruff_transform", "qmc_quad", "datetime64"),
    *("from_xml_path", "from_binary_path", "from_file", "from_zip", "mj_loadXML", "mj_loadModel"),
    *("random", "rand", "randn", "randint", "uniform", "normal", "default_rng", "rvs"),
    *("sample", "samples"),
}
"""Names of objects that differ between processes or depend on files, whatever code uses them."""
READERS = ("load_", "read_")
"""Prefixes of the names of functions that read files, as ``load_npz``."""

DISPATCHER = type(np.linalg.norm)
"""The type of NumPy's functions that other array types may override."""

ValueIdentity: TypeAlias = Callable[[object], object]
"""Returns the identity of a value that a function reaches; TypeError if it has none."""


def is_covered(module: str | None) -> bool:
    """Return whether the surroundings of a result decide what a module does."""
    module = module or ""
    package, _, part = module.partition(".")
    if package not in COVERED or module.startswith(OUTSIDE):
        return module in PURE
    return package not in PARTS or not part or part.startswith(PARTS[package])


def is_unstable(name: str) -> bool:
    """Return whether an object of this name may differ between processes or depend on files."""
    return name in UNSTABLE or name.startswith(READERS)


class FunctionIdentity:
    """The identities of functions.

    Parameters
    ----------
    of_value : callable
        Returns the identity of a value that is not a function, class or module.
    """

    def __init__(self, of_value: ValueIdentity) -> None:
        self._of_value = of_value
        self._known: dict[int, int] = {}
        self._kept: list[object] = []
        self._modules: set[str] = set()
        self._names: set[str] = set()

    def of(self, value: object) -> object:
        """Return the identity of a value that a function may reach, as plain data.

        Raises
        ------
        TypeError
            If it has none, as a user's class, or an object of such a class.
        """
        match value:
            case ModuleType():
                self._check_parts({value.__name__}, set())
                return "module", value.__name__
            case MethodType():
                return "method", self.of(value.__self__), self.of(value.__func__)
            case FunctionType():
                return self._function(value)
            case type() | np.ufunc() | BuiltinFunctionType() | DISPATCHER():
                return self._builtin(value)
            case functools.partial() | list() | tuple() | set() | frozenset() | dict():
                # A class of the user's has methods of its own.
                known = is_covered(type(value).__module__)
                return self._container(value) if known else self._of_value(value)
            case _:
                return self._of_value(value)

    def _builtin(self, value: Any) -> object:
        if isinstance(value, np.ufunc):
            return self._ufunc(value)
        owner = getattr(value, "__self__", None)
        if isinstance(value, BuiltinFunctionType) and not isinstance(owner, ModuleType | None):
            return "bound", self.of(owner), value.__name__
        return self._named("name", value.__module__, value.__qualname__)

    def _ufunc(self, value: np.ufunc) -> object:
        name: Any = value.__name__
        if value is not getattr(np, name, None):
            raise TypeError(f"{value!r} has no identity that lasts")
        return "ufunc", name

    def _check_parts(self, modules: set[str], names: set[str]) -> None:
        """Refuse parts without an identity, for any module and name that functions used so far."""
        self._modules |= modules
        self._names |= names
        for module in sorted(self._modules):
            for part in _parts(module, self._names):
                self._named("module", part, "")

    def _named(self, kind: str, module: str | None, name: str) -> object:
        if not is_covered(module) or is_unstable(name.rpartition(".")[2]):
            raise TypeError(f"{kind} {module or ''}.{name} has no identity that lasts".strip())
        return kind, module, name

    def _container(self, value: object) -> object:
        if (first := self._again(value)) is not None:
            return first
        kind = f"{type(value).__module__}.{type(value).__qualname__}"
        if isinstance(value, functools.partial):
            parts = value.func, value.args, value.keywords, vars(value)
            return kind, *map(self.of, parts)
        if isinstance(value, dict):
            missing = value.default_factory if isinstance(value, defaultdict) else None
            items = [(self.of(key), self.of(one)) for key, one in value.items()]
            return kind, items, self.of(missing)
        assert isinstance(value, list | tuple | set | frozenset)
        if isinstance(value, set | frozenset):
            # The order of a set differs between processes.
            return kind, sorted(repr(self.of(one)) for one in value)
        return kind, [self.of(one) for one in value]

    def _again(self, value: object) -> object:
        """Return the number of a value that was met before, or None: functions may form cycles."""
        if id(value) in self._known:
            return "again", self._known[id(value)]
        self._known[id(value)] = len(self._known)
        self._kept.append(value)  # so that no other object takes its id
        return None

    def _function(self, value: FunctionType) -> object:
        if (first := self._again(value)) is not None:
            return first
        cells = [self._cell(cell) for cell in value.__closure__ or ()]
        rest = self.of(value.__defaults__), self.of(value.__kwdefaults__), self.of(vars(value))
        code = value.__code__
        # The module whose names it uses: a wrapper copies ``__module__`` of the wrapped function.
        module = value.__globals__.get("__name__")
        if is_covered(module) or (module or "").partition(".")[0] in COVERED:
            named = self._named("function", module, value.__qualname__)
            return named, _code(code), cells, *rest
        names = _names(code)
        if unstable := sorted(filter(is_unstable, names)):
            raise TypeError(f"a function that uses {unstable[0]} has no identity that lasts")
        self._check_parts(_imported(code), names)
        used = {name: self._global(value, name) for name in sorted(names)}
        return "function", _code(code), cells, *rest, used

    def _cell(self, cell: CellType) -> object:
        try:
            return self.of(cell.cell_contents)
        except ValueError:  # nothing is in it yet, or no longer
            return "empty"

    def _global(self, function: FunctionType, name: str) -> object:
        if name in function.__globals__:
            return self.of(function.__globals__[name])
        return "builtin" if hasattr(builtins, name) else "attribute"


def _parts(module: str, names: set[str]) -> Iterator[str]:
    """Yield a module, and for each name in it the submodule, or the module that defines the part.

    A module is imported only after it was yielded, so that a caller can refuse it before.
    """
    yield module
    whole = import_module(module)
    for name in sorted(names.intersection(dir(whole))):
        part = getattr(whole, name)
        if isinstance(part, ModuleType) and part.__name__.startswith(f"{module}."):
            yield from _parts(part.__name__, names)
        elif isinstance(part, type | FunctionType):
            yield part.__module__


def _names(code: CodeType) -> set[str]:
    """Return the names that code looks up, in functions within it too."""
    inner = [_names(one) for one in code.co_consts if isinstance(one, CodeType)]
    return set(code.co_names).union(*inner)


def _imported(code: CodeType) -> set[str]:
    """Return the modules that code imports, in functions within it too; "" is its own package."""
    inner = [_imported(one) for one in code.co_consts if isinstance(one, CodeType)]
    own = {i.argval for i in dis.get_instructions(code) if i.opname == "IMPORT_NAME"}
    return own.union(*inner)


def _code(code: CodeType) -> object:
    """Return everything of a code object that decides what it does, as plain data."""
    sizes = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
    consts = [_constant(one) for one in code.co_consts]
    return code.co_code, code.co_exceptiontable, list(sizes), [list(some) for some in names], consts


def _constant(value: object) -> object:
    if isinstance(value, CodeType):
        return _code(value)
    if isinstance(value, frozenset):
        return "set", sorted(map(repr, value))
    if isinstance(value, tuple):
        return [_constant(one) for one in value]
    # By their texts: 0.0 equals -0.0, and NaN does not equal itself.
    return type(value).__name__, repr(value)
