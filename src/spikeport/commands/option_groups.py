"""Groups of options that become options of a command.

A group of options is a frozen dataclass whose fields are annotated for typer. `with_options` makes
an option of each field, so that a group is declared once, reaches its command as one value, and
names every value it holds.
"""

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar, get_type_hints

Result = TypeVar("Result")


def with_options(command: Callable[..., Result]) -> Callable[..., Result]:
    """Return a command with an option for each field of the groups among its parameters."""
    hints = get_type_hints(command)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

    @functools.wraps(command)
    def flattened(**values: Any) -> Result:
        made = {
            name: group(**{one.name: values.pop(one.name) for one in fields(group)})
            for name, group in groups.items()
        }
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


def _options(group: Any) -> list[inspect.Parameter]:
    """Return a parameter for each field of a group, with its annotation and default."""
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if one.default is MISSING else one.default,
            annotation=hints[one.name],
        )
        for one in fields(group)
    ]


def given(*groups: Any) -> str:
    """Return the names of the options in groups whose values differ from their defaults."""
    return ", ".join(
        "--" + one.name.replace("_", "-")
        for group in groups
        for one in fields(group)
        if getattr(group, one.name) not in (one.default, [])  # a repeatable one has no default
    )
