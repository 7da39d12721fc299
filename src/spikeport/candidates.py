"""The networks in a user's module, and its functions and classes that make one."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType
from typing import get_type_hints

import nengo

WITHIN = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)
"""Nodes in a function whose return statements are their own."""


def networks_in(module: ModuleType) -> dict[str, nengo.Network]:
    """Return the networks of a module, by name."""
    return {n: v for n, v in _public(module) if isinstance(v, nengo.Network)}


def makers_in(module: ModuleType) -> dict[str, Callable[..., object]]:
    """Return a module's own functions and classes that make networks, by name."""
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

    The function is not called to find out: a user's functions may do anything.
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

    def makes(node: ast.expr | None) -> bool:
        return _calls_network(node, function.__globals__, callers)

    try:
        source = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError):  # as of a lambda within an expression
        return False
    nodes = list(_own_nodes(source))
    bound = {name for node in nodes for name, value in _bindings(node) if makes(value)}
    returned = [n.value for n in nodes if isinstance(n, ast.Return) and n.value]
    return any(ast.unparse(one) in bound or makes(one) for one in returned)


def _own_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function, except those of functions and classes within it."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, WITHIN):
            yield child
            yield from _own_nodes(child)


def _bindings(node: ast.AST) -> Iterator[tuple[str, ast.expr | None]]:
    """Yield the names that a node binds, each with the value."""
    match node:
        case ast.withitem(context_expr=value, optional_vars=ast.expr() as name):
            yield ast.unparse(name), value
        case ast.Assign(targets=names, value=value):
            yield from ((ast.unparse(name), value) for name in names)
        case ast.AnnAssign(target=name, value=value) | ast.NamedExpr(target=name, value=value):
            yield ast.unparse(name), value


def _calls_network(
    node: ast.expr | None, names: dict[str, object], callers: frozenset[FunctionType]
) -> bool:
    """Return whether an expression calls a class of networks, or a function that returns one."""
    if isinstance(node, ast.NamedExpr):
        node = node.value
    if not isinstance(node, ast.Call):
        return False
    first, *rest = ast.unparse(node.func).split(".")
    called = names.get(first)
    for name in rest:
        called = getattr(called, name, None)
    return _is_network_class(called) or (callable(called) and _returns_network(called, callers))
