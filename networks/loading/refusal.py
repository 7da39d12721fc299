"""The error for a file of a policy or a network: expected, found, and a cure."""

import contextlib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

from spikeport.errors import UsageError
from spikeport.extras import missing
from spikeport.reading.mismatch import MismatchError

CURE = "see docs/convert.md, 'Refused policies'"

EXPORT = "export the policy to ONNX, and convert that"

SAVE = "save the policy by torch.jit.trace(policy, observations).save(FILE), or export it to ONNX"


@contextlib.contextmanager
def refusing(path: Path, cure: str = CURE, kind: str = "policy file") -> Iterator[None]:
    """Refuse the file at ``path`` for any mismatch that is found while it is read."""
    try:
        yield
    except MismatchError as error:
        raise UsageError(f"{kind} '{path}': {error}; {error.cure or cure}") from error


def extra(module: str) -> ModuleType:
    """Import a module of the extra ``convert``.

    Raises
    ------
    MissingExtraError
        The package of the module is absent.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise missing("reading this file", error.name, "convert") from error
