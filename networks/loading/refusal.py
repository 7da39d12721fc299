"""How a policy file is refused: what was expected, what was found, and what helps."""

import contextlib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

from spikeport.errors import MissingExtraError, UsageError

CURE = "what can be read: spikeport convert --help"


class MismatchError(Exception):
    """A file does not hold what it should; `refusing` makes a `UsageError` of it."""

    def __init__(self, expected: str, found: str) -> None:
        super().__init__(f"expected {expected}, found {found}")


@contextlib.contextmanager
def refusing(path: Path, cure: str = CURE) -> Iterator[None]:
    """Refuse the file at ``path`` for what does not match while it is read."""
    try:
        yield
    except MismatchError as error:
        raise UsageError(f"policy file '{path}': {error}; {cure}") from error


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
