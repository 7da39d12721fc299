"""Groups of options that become options of a command.

A group of options is a frozen dataclass whose fields are annotated for typer, as arguments or
options, or are groups themselves. `with_options` makes an argument or option of each, so that a
group is declared once, reaches its command as one value, and names every value it holds. Fields
that are not annotated keep their defaults.
"""

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from typing import Annotated, Any, TypeVar, get_origin, get_type_hints

Result = TypeVar("Result")


def with_options(command: Callable[..., Result]) -> Callable[..., Result]:
    """Return a command with an option for each field of the groups among its parameters."""
    hints = get_type_hints(command)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

    @functools.wraps(command)
    def flattened(**values: Any) -> Result:
        made = {name: _made(group, values) for name, group in groups.items()}
        return command(**values, **made)

    parameters = [
        one
        for name, parameter in inspect.signature(command).parameters.items()
        for one in (_options(groups[name]) if name in groups else [parameter])
    ]
    flattened.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    )
    return flattened


def _made(group: Any, values: dict[str, Any]) -> Any:
    """Return a group, and the groups within it, of values that are taken out of those of a call."""
    hints = get_type_hints(group, include_extras=True)
    return group(
        **{
            one.name: _made(hints[one.name], values)
            if is_dataclass(hints[one.name])
            else values.pop(one.name)
            for one in fields(group)
            if _is_asked(hints[one.name])
        }
    )


def _options(group: Any) -> Iterator[inspect.Parameter]:
    """Yield a parameter for each field of a group, with its annotation and default."""
    hints = get_type_hints(group, include_extras=True)
    for one in fields(group):
        hint = hints[one.name]
        if is_dataclass(hint):
            yield from _options(hint)
        elif _is_asked(hint):
            default = inspect.Parameter.empty if one.default is MISSING else one.default
            kind = inspect.Parameter.KEYWORD_ONLY
            yield inspect.Parameter(one.name, kind, default=default, annotation=hint)


def _is_asked(hint: Any) -> bool:
    return is_dataclass(hint) or get_origin(hint) is Annotated


def given(*groups: Any) -> str:
    """Return the names of the options in groups whose values differ from their defaults.

    The groups hold options alone, which have the names of their fields.
    """
    return ", ".join(
        "--" + one.name.replace("_", "-")
        for group in groups
        for one in fields(group)
        if getattr(group, one.name) not in (one.default, [])  # a repeatable one has no default
    )
