"""Files of TOML, JSON and arrays: path and reason in errors, written whole or not at all."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, BaseModel, Field, ValidationError
from pydantic_core import ErrorDetails

from spikeport.atomic import atomic_path, write_text
from spikeport.errors import SpikeportError, UsageError, printable
from spikeport.reading.archive import UnreadableError
from spikeport.reading.mismatch import MismatchError, shown
from spikeport.reading.text import parse_json, parse_toml, read_text

M = TypeVar("M", bound=BaseModel)
Refusal = type[SpikeportError]

MOST_LISTED = 20
"""Most errors in a file that are listed, each on a line."""


def _on_a_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError(f"holds control characters: '{shown(text)}'")
    return text


Line = Annotated[str, AfterValidator(_on_a_line)]
"""A text of a file that reports print: a terminal would obey control characters in it."""

Name = Annotated[str, Field(min_length=1), AfterValidator(_on_a_line)]
"""A `Line` that is not empty."""

REASONS = {"missing": "is missing", "extra_forbidden": "is not a known key"}


def read_toml(path: Path, refusal: Refusal = UsageError) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises
    ------
    UsageError, or another ``refusal``
        The file cannot be read, or is not TOML; the message gives path and reason.
    """
    content: dict[str, Any] = _read(path, parse_toml, "TOML", refusal)
    return content


def read_json(path: Path, refusal: Refusal = UsageError) -> Any:
    """Return the content of a JSON file.

    Raises
    ------
    UsageError, or another ``refusal``
        The file cannot be read, or is not JSON; the message gives path and reason.
    """
    return _read(path, parse_json, "JSON", refusal)


def read_model(
    path: Path,
    model: type[M],
    what: str,
    refusal: Refusal = UsageError,
    read: Callable[[Path, Refusal], Any] = read_toml,
) -> M:
    """Return the model that a file holds; an error lists everything that is wrong with it.

    Parameters
    ----------
    path : Path
        The file.
    model : type of pydantic's BaseModel
        The model.
    what : str
        The kind of file expected, for messages, e.g. ``"chip"``.
    refusal : type of SpikeportError
        The error for a file that is wrong.
    read : callable
        `read_toml` or `read_json`.

    Raises
    ------
    UsageError, or another ``refusal``
        The file cannot be read, is not of its format, or does not fit the model.
    """
    try:
        return model.model_validate(read(path, refusal))
    except ValidationError as error:
        raise refusal(f"{path}: not a {what}:\n{_listed(error.errors())}") from None


def write_json(path: Path, value: Any) -> None:
    """Write a JSON file, whole or not at all; numbers that are not finite become null."""
    write_text(path, json.dumps(_plain(value), indent=2, allow_nan=False) + "\n")


def write_arrays(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write an npz file of arrays, numbers and texts, whole or not at all."""
    # A file, not a name: NumPy would add .npz to a name without it.
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _read(path: Path, parse: Callable[[str], Any], kind: str, refusal: Refusal) -> Any:
    try:
        return parse(read_text(path))
    except UnreadableError as error:
        raise refusal(str(error)) from None
    except (ValueError, MismatchError) as error:  # of either parser, or of bytes that are no text
        raise refusal(f"{path}: not {kind}: {printable(str(error))}") from error
    except RecursionError:
        raise refusal(f"{path}: not {kind}: it is nested too deeply; write it flat") from None


def _listed(errors: Sequence[ErrorDetails]) -> str:
    """Return a line for each error up to `MOST_LISTED`, and one with the number of the others."""
    rows = [f"  {shown(_dotted(e))}: {shown(_reason(e))}" for e in errors[:MOST_LISTED]]
    more = len(errors) - len(rows)
    return "\n".join([*rows, *([f"  and {more:,} more"] if more else [])])


def _dotted(error: ErrorDetails) -> str:
    return ".".join(str(key) for key in error["loc"])


def _reason(error: ErrorDetails) -> str:
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    return REASONS.get(error["type"], error["msg"])


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
