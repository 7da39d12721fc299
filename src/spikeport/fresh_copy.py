"""A copy of a network with functions of its own, for a second run beside a first.

`nengo.Network.copy` copies the objects that nodes call, but shares functions, and so the variables
that they change: a plant's state in such a variable would go on where the first run left it.
"""

import contextlib
import io
import pickle
import sys
import warnings
import weakref
from collections.abc import Iterator
from pathlib import Path
from types import BuiltinFunctionType, ModuleType
from typing import Any

import cloudpickle
import nengo

from spikeport import user_code
from spikeport.errors import LIBRARIES, UsageError
from spikeport.node_functions import Skippable
from spikeport.parts import OWNERS, STRUCTS, Parts


def fresh_copy(network: nengo.Network) -> nengo.Network:
    """Return a copy of a network, and of the variables of a user's functions that it calls.

    The network is not built again, since its weights would differ wherever a user's random numbers
    have no seed. A network without functions is returned itself. If variables cannot be copied,
    such as a lock or an open file, functions are shared, and a warning says so.

    Raises
    ------
    UsageError
        If the plant of a loop, or one of its ports, cannot be copied: a loop has one simulator.
    """
    if not _calls(network):
        return network
    try:
        with _by_value(_own_modules()), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Nengo warned when the network was made
            return _copied(network)
    except Exception as error:  # whatever copying a user's object raises
        if any(isinstance(node.output, Skippable) for node in network.all_nodes):
            raise UsageError(
                f"the plant or a port of the network cannot be copied ({error}), and float Nengo, "
                "with which the run is compared, needs a plant of its own; cure: leave out what "
                "cannot be copied, such as a lock, a viewer or an open file, or do not compare: "
                "simulate --no-float, or compile without --loss"
            ) from error
        warnings.warn(
            f"the network's functions cannot be copied ({error}): in float Nengo their "
            "variables start with the values that the earlier run left; cure: keep a state in a "
            "nengo.Process, which begins anew in each run",
            stacklevel=2,
        )
        return _with_shared_functions(network)


def _calls(network: nengo.Network) -> bool:
    """Return whether a network calls functions in its steps, other than processes."""
    called = [node.output for node in network.all_nodes]
    called += [connection.function for connection in network.all_connections]
    return any(callable(one) and not isinstance(one, nengo.Process) for one in called)


def _copied(network: nengo.Network) -> nengo.Network:
    file = io.BytesIO()
    pickler = _Pickler(file, Parts(_owners(network)))
    pickler.dump(network)
    file.seek(0)
    with _new_classes():
        copy: nengo.Network = _Unpickler(file, pickler.code).load()
    return copy


@contextlib.contextmanager
def _new_classes() -> Iterator[None]:
    """Make classes of a script anew within the context: their methods change its variables, too.

    cloudpickle has a table of the classes that it pickled, and would return these.
    """
    module = cloudpickle.cloudpickle
    table = module._DYNAMIC_CLASS_TRACKER_BY_ID
    module._DYNAMIC_CLASS_TRACKER_BY_ID = weakref.WeakValueDictionary()
    try:
        yield
    finally:
        module._DYNAMIC_CLASS_TRACKER_BY_ID = table


class _Pickler(cloudpickle.Pickler):
    """A pickler that shares code which numba compiled: it cannot be copied, and has no state.

    Parts of copied objects are the parts of their copies.
    """

    def __init__(self, file: io.BytesIO, parts: Parts) -> None:
        super().__init__(file)
        self.code: list[object] = []
        self._parts = parts

    def persistent_id(self, one: object) -> int | None:
        """Return the number of an object that is shared; None to copy it."""
        if type(one) is not BuiltinFunctionType or type(one.__self__).__module__ != "_dynfunc":
            return None
        self.code.append(one)
        return len(self.code) - 1

    def reducer_override(self, one: object) -> Any:
        """Return how an object is made again."""
        return self._parts.call_for(one) or super().reducer_override(one)


class _Owners(_Pickler):
    """A pickler that lists the models and data of MuJoCo that it meets, and writes none of them."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), Parts([]))
        self.found: list[object] = []

    def persistent_id(self, one: object) -> int | None:
        """Return a number for what belongs to MuJoCo; None to go on with another object."""
        if type(one).__module__ != STRUCTS:
            return super().persistent_id(one)
        if type(one).__name__ in OWNERS:
            self.found.append(one)
        return 0


def _owners(network: nengo.Network) -> list[object]:
    pickler = _Owners()
    if STRUCTS in sys.modules:
        pickler.dump(network)
    return pickler.found


class _Unpickler(pickle.Unpickler):
    """An unpickler that takes shared objects from a list, by their numbers."""

    def __init__(self, file: io.BytesIO, shared: list[object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, number: int) -> object:
        """Return the shared object of a number."""
        return self._shared[number]


def _with_shared_functions(network: nengo.Network) -> nengo.Network:
    with contextlib.suppress(Exception):
        return network.copy(add_to_container=False)
    return network


def _own_modules() -> set[ModuleType]:
    """Return the modules of the user, whose functions may change variables."""
    found = set()
    for name, module in list(sys.modules.items()):
        # A notebook's module has no file, as in Jupyter.
        if name in user_code.RAN or (_is_file_of_user(module) and not _is_known(name)):
            found.add(module)
    return found


def _is_file_of_user(module: ModuleType) -> bool:
    file = getattr(module, "__file__", None)
    return file is not None and not any(Path(file).is_relative_to(one) for one in LIBRARIES)


def _is_known(name: str) -> bool:
    """Return whether a module is spikeport's, or the main one, which is copied in any case."""
    return name.partition(".")[0] in ("__main__", "spikeport")


@contextlib.contextmanager
def _by_value(modules: set[ModuleType]) -> Iterator[None]:
    """Pickle functions of modules with their variables within the context, and not by name."""
    known = cloudpickle.list_registry_pickle_by_value()
    added = [one for one in modules if one.__name__ not in known and one.__name__ in sys.modules]
    for module in added:
        cloudpickle.register_pickle_by_value(module)
    try:
        yield
    finally:
        for module in added:
            cloudpickle.unregister_pickle_by_value(module)
