"""``KEY=VALUE`` settings, checked against the parameters of a function or dataclass."""

import inspect
import types
import typing
from collections.abc import Callable, Iterable

from spikeport.errors import UsageError, unknown

SWITCH_OR_TEXT = bool | str
PLAIN = (int, float, bool, str)
BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}

Value = bool | int | float | str
Kind = type | types.UnionType
"""One of `PLAIN`, or `SWITCH_OR_TEXT`."""
Target = Callable[..., object]


def parse(
    pairs: Iterable[str], target: Target, owner: str, option: str = "--set"
) -> dict[str, Value]:
    """Keyword arguments for ``target`` from ``KEY=VALUE`` texts.

    Values are converted to the type each parameter is annotated with (or that of its default):
    int, float, bool or str; for ``bool | str`` what is not true or false is a text. ``option`` is
    where the texts come from, for messages.

    Raises
    ------
    UsageError
        For a text without ``=``, a key that is not a parameter (lists those there are), a key given
        twice, or a value that does not convert.
    """
    parameters = _parameters(target, owner)
    values: dict[str, Value] = {}
    for pair in pairs:
        key, equals, text = pair.partition("=")
        if not equals:
            raise UsageError(f"{option} {pair}: expected KEY=VALUE")
        if key not in parameters:
            raise (
                unknown(f"key of {owner}", key, parameters)
                if parameters
                else UsageError(f"unknown key of {owner} '{key}'; it takes none")
            )
        if key in values:
            raise UsageError(f"{option} {key}: given twice")
        values[key] = _convert(text, parameters[key], f"{option} {key}")
    return values


def _parameters(target: Target, owner: str) -> dict[str, Kind]:
    try:
        parameters = inspect.signature(target).parameters
    except (TypeError, ValueError) as error:
        raise UsageError(f"{owner}: its parameters cannot be read: {error}") from None
    return {
        name: _plain_type(_evaluated(parameter.annotation, target), parameter.default)
        for name, parameter in parameters.items()
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    }


def _evaluated(annotation: object, target: Target) -> object:
    """What an annotation in quotes means; None for names that only type checkers import."""
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, dict(getattr(target, "__globals__", {})))
    except Exception:
        return None


def _plain_type(hint: object, default: object) -> Kind:
    if hint == SWITCH_OR_TEXT:
        return SWITCH_OR_TEXT
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        hint = next(t for t in typing.get_args(hint) if t is not type(None))
    if isinstance(hint, type) and hint in PLAIN:
        return hint
    return type(default) if type(default) in PLAIN else str


def _convert(text: str, kind: Kind, what: str) -> Value:
    if isinstance(kind, types.UnionType):
        return BOOLEANS.get(text.lower(), text)
    try:
        return BOOLEANS[text.lower()] if kind is bool else kind(text)
    except (ValueError, KeyError):
        raise UsageError(f"{what}={text}: expected {_describe(kind)}") from None


def _describe(kind: type) -> str:
    return {int: "a whole number", float: "a number", bool: "true or false"}[kind]
