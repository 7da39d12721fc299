"""Reads a TOML file into a model, and says all that is wrong with it at once."""

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from spikeport.errors import ChipFileError, SpikeportError

M = TypeVar("M", bound=BaseModel)

REASONS = {"missing": "is missing", "extra_forbidden": "is not a known key"}


def read(
    path: Path,
    model: type[M],
    what: str = "chip",
    refusal: type[SpikeportError] = ChipFileError,
) -> M:
    """The content of the file; ``what`` it is to be, for messages.

    Raises
    ------
    ChipFileError, or another ``refusal``
        The file cannot be read, is not TOML, or does not fit the model.
    """
    try:
        return model.model_validate(_toml(path, refusal))
    except ValidationError as error:
        rows = "\n".join(f"  {_dotted(e)}: {_reason(e)}" for e in error.errors())
        raise refusal(f"{path}: not a {what}:\n{rows}") from None


def _toml(path: Path, refusal: type[SpikeportError]) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise refusal(f"{path}: no such file") from None
    except OSError as error:
        raise refusal(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise refusal(f"{path}: not TOML: {error}") from error


def _dotted(error: ErrorDetails) -> str:
    return ".".join(str(key) for key in error["loc"])


def _reason(error: ErrorDetails) -> str:
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    return REASONS.get(error["type"], error["msg"])
