"""How a policy file is refused: what was expected, what was found, and what helps."""

import contextlib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

from spikeport.errors import MissingExtraError, UsageError

CURE = "what can be read: spikeport convert --help"

EXPORT = "export the policy to ONNX, and convert that"

SHOWN = 400
"""How much of what stands in a file a message shows, in characters."""


class MismatchError(Exception):
    """A file does not hold what it should; `refusing` makes a `UsageError` of it.

    ``cure`` is one that is better than the reader's.
    """

    def __init__(self, expected: str, found: str, cure: str | None = None) -> None:
        super().__init__(f"expected {_shown(expected)}, found {_shown(found)}")
        self.cure = cure


def _shown(text: str) -> str:
    """Return a text on one line: names out of a file may hold anything, and be of any length."""
    short = text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
    return "".join(letter if letter.isprintable() else "?" for letter in short)


@contextlib.contextmanager
def refusing(path: Path, cure: str = CURE) -> Iterator[None]:
    """Refuse the file at ``path`` for what does not match while it is read."""
    try:
        yield
    except MismatchError as error:
        raise UsageError(f"policy file '{path}': {error}; {error.cure or cure}") from error


def extra(module: str) -> ModuleType:
    """Import a module of the extra ``convert``.

    Raises
    ------
    MissingExtraError
        Its package is absent.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"reading this file needs the package {error.name}, which is not installed; "
            "install it with: pip install 'spikeport[convert]'"
        ) from error
