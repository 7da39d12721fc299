"""The networks in a module of a user's, and what there makes one."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType
from typing import get_type_hints

import nengo


def networks_in(module: ModuleType) -> dict[str, nengo.Network]:
    """Return the networks of a module, by name."""
    return {n: v for n, v in _public(module) if isinstance(v, nengo.Network)}


def makers_in(module: ModuleType) -> dict[str, Callable[..., object]]:
    """Return the functions and classes that make networks, by name: its own, none it imports."""
    return {
        name: value
        for name, value in _public(module)
        if callable(value)
        and getattr(value, "__module__", "") == module.__name__
        and (_is_network_class(value) or _returns_network(value))
    }


def _public(module: ModuleType) -> Iterator[tuple[str, object]]:
    return ((name, value) for name, value in vars(module).items() if not name.startswith("_"))


def _is_network_class(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, nengo.Network)


def _returns_network(
    value: Callable[..., object], callers: frozenset[FunctionType] = frozenset()
) -> bool:
    """Return whether a function is annotated with a network, or its source returns one.

    It is not called to find out: a user's functions may do anything.
    """
    function = inspect.unwrap(value)
    if not isinstance(function, FunctionType) or function in callers:
        return False
    return _is_network_class(_stated(function)) or _source_returns(function, callers | {function})


def _stated(function: object) -> object:
    """Return the type that a function is annotated to return, if it can be known."""
    try:
        return get_type_hints(function).get("return")
    except Exception:  # whatever a user's annotation in quotes may raise
        return None


def _source_returns(function: FunctionType, callers: frozenset[FunctionType]) -> bool:
    """Return whether a function returns a call of a network, or a name that is bound to one."""

    def makes(node: ast.expr) -> bool:
        return _calls_network(node, function.__globals__, callers)

    try:
        source = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, TypeError, SyntaxError):  # as of a lambda within an expression
        return False
    bound = set[str]()
    for node in ast.walk(source):
        if isinstance(node, ast.withitem) and makes(node.context_expr):
            bound.update([ast.unparse(node.optional_vars)] if node.optional_vars else [])
        elif isinstance(node, ast.Assign) and makes(node.value):
            bound.update(map(ast.unparse, node.targets))
    returned = [n.value for n in ast.walk(source) if isinstance(n, ast.Return) and n.value]
    return any(ast.unparse(one) in bound or makes(one) for one in returned)


def _calls_network(
    node: ast.expr, names: dict[str, object], callers: frozenset[FunctionType]
) -> bool:
    """Return whether an expression calls a class of networks, or a function that returns one."""
    if not isinstance(node, ast.Call):
        return False
    first, *rest = ast.unparse(node.func).split(".")
    called = names.get(first)
    for name in rest:
        called = getattr(called, name, None)
    return _is_network_class(called) or (callable(called) and _returns_network(called, callers))
