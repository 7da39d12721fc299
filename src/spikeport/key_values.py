"""``KEY=VALUE`` texts, checked against the parameters of a function or dataclass."""

import contextlib
import functools
import inspect
import json
import operator
import types
from collections.abc import Callable, Iterable
from dataclasses import is_dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BeforeValidator, Field, Json, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from spikeport.errors import UsageError, unknown

PLAIN = (int, float, bool, str)
CONTAINERS = (tuple, list, dict)
"""Types of values that are written in JSON, as in ``rates=[100, 200]``."""
UNIONS = (Union, types.UnionType)
EXPECTED = {
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
    "bool_parsing": "true or false",
    "literal_error": "{expected}",
    "json_invalid": "JSON, as in [1, 2]",
}
"""The value expected, by pydantic's name of the error; other errors keep pydantic's message."""

SettingValue = bool | int | float | str


def parse(
    pairs: Iterable[str], target: Callable[..., object], owner: str, option: str = "--set"
) -> dict[str, Any]:
    """Return keyword arguments for ``target`` from ``KEY=VALUE`` texts.

    Parameters
    ----------
    pairs : iterable of str
        The texts.
    target : callable
        The function that takes the arguments; see `parameters`.
    owner : str
        The name of the function in messages.
    option : str
        The source of the texts, for messages.

    Raises
    ------
    UsageError
        For a text without ``=``, a key that is not a parameter (the message lists them), a key set
        twice, or a value that does not convert.
    """
    split = []
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals:
            raise UsageError(f"{option} {pair}: expected KEY=VALUE")
        split.append((key, text))
    return converted(split, parameters(target, owner), f"key of {owner}", option)


def parameters(target: Callable[..., object], owner: str) -> dict[str, Any]:
    """Return the parameters that can be set by name, each with the type of its values.

    A parameter's type is its annotation, if that is bool, int, float, str, a choice of texts or a
    union of these, with bounds or without, or a tuple, list or dict, which is written in JSON; else
    the type of its default. Without either, it takes a number, true or false, JSON, or any text.

    Raises
    ------
    UsageError
        If the parameters of the target cannot be read.
    """
    try:
        found = inspect.signature(target).parameters
    except (TypeError, ValueError) as error:
        raise UsageError(f"{owner}: its parameters cannot be read: {error}") from None
    hints = _hints(target)
    return {
        name: _type(hints.get(name), parameter.default)
        for name, parameter in found.items()
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    }


def converted(
    pairs: Iterable[tuple[str, str]], kinds: dict[str, Any], kind: str, where: str
) -> dict[str, SettingValue]:
    """Return the values of texts, by key.

    Parameters
    ----------
    pairs : iterable of (str, str)
        Keys and texts.
    kinds : dict
        The types of the values, by key, as from `parameters`.
    kind : str
        The name of a key in messages, e.g. ``"key of network 'arm'"``.
    where : str
        The source of the pairs, for messages, e.g. ``"--set"``.

    Raises
    ------
    UsageError
        If a key is unknown or repeated, or a text is not of its type.
    """
    values: dict[str, SettingValue] = {}
    for key, text in pairs:
        if key not in kinds:
            raise (
                unknown(kind, key, kinds)
                if kinds
                else UsageError(f"unknown {kind} '{key}'; it takes none")
            )
        if key in values:
            raise UsageError(f"{where} {key}: given twice")
        values[key] = _convert(text, kinds[key], f"{where} {key}")
    return values


def check_fields(value: object, owner: str) -> None:
    """Check the plain fields of a dataclass against the types and bounds in their annotations.

    Raises
    ------
    UsageError
        For a wrong value; the message names the owner, the field and the value.
    """
    for name, kind in _hints(type(value)).items():
        found = getattr(value, name)
        if _is_known(kind):
            # NumPy's numbers are as good, but pydantic does not take them for an int.
            plain = found.item() if isinstance(found, np.generic) else found
            _valid(plain, TypeAdapter(kind), f"{owner}{name}", strict=True)


def _convert(text: str, kind: Any, what: str) -> SettingValue:
    return _valid(text, TypeAdapter(_in_order(kind)), what)


def _valid(value: Any, kind: TypeAdapter[Any], what: str, strict: bool = False) -> SettingValue:
    try:
        found: SettingValue = kind.validate_python(value, strict=strict)
    except ValidationError as error:
        (*_, last) = error.errors()  # the last type of a union accepts most
        reason = last["msg"][0].lower() + last["msg"][1:]
        if last["type"] in EXPECTED:
            reason = "expected " + EXPECTED[last["type"]].format(**last.get("ctx", {}))
        raise UsageError(f"{what}={value}: {reason}") from None
    return found


def _in_order(kind: Any) -> Any:
    """Return a type whose members are tried from left to right, without None: it has no text."""
    kind = _without_none(kind)
    if get_origin(kind) not in UNIONS:
        return kind
    # By itself pydantic prefers the type that is closest to a text.
    return Annotated[kind, Field(union_mode="left_to_right")]


def _without_none(kind: Any) -> Any:
    if get_origin(kind) not in UNIONS:
        return kind
    members = (one for one in get_args(kind) if one is not types.NoneType)
    return functools.reduce(operator.or_, members)


def _hints(target: Callable[..., object]) -> dict[str, Any]:
    """Return the annotated types of parameters, as far as they can be evaluated."""
    while isinstance(target, functools.partial):
        target = target.func
    holder: Any = target
    if inspect.isclass(holder) and not is_dataclass(holder):
        holder = holder.__init__
    absent: dict[str, Any] = {}
    while True:
        try:
            return get_type_hints(holder, localns=absent, include_extras=True)
        except NameError as error:  # a name that only type checkers import
            if error.name is None or error.name in absent:
                return {}
            absent[error.name] = object
        except Exception:  # whatever a user's annotation in quotes may raise
            return {}


def _type(hint: Any, default: object) -> Any:
    if _is_known(hint):
        return hint
    for kind in (_without_none(hint), type(default)):
        container = get_origin(kind) or kind
        if container in CONTAINERS:
            try:
                TypeAdapter(kind)
            except PydanticUserError:  # of values that JSON does not have, as of arrays
                return Annotated[container, Json]
            return Annotated[kind, Json]
    return type(default) if type(default) in PLAIN else Annotated[object, BeforeValidator(_read)]


def _read(text: str) -> object:
    """Return the value of a text where no type is stated: "false" as a text would count as true."""
    for reader in (int, float, json.loads):
        with contextlib.suppress(ValueError, RecursionError):
            return reader(text)
    return {"true": True, "false": False}.get(text.lower(), text)


def _is_known(hint: Any) -> bool:
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _is_known(arguments[0])
    if origin is Literal:
        return all(isinstance(one, str) for one in arguments)
    if origin in UNIONS:
        return all(one is types.NoneType or _is_known(one) for one in arguments)
    return hint in PLAIN
