"""Every error spikeport raises on purpose.

    SpikeportError
    ├── UsageError (ValueError)            a name, key or value is not known: lists known ones
    │   └── ArgumentError                  ... or an argument; nengo's ValidationError too
    ├── MissingExtraError (ImportError)    an optional package is absent: names the extra
    ├── ChipFileError (ValueError)         a chip's TOML is wrong: path and reason
    ├── NetworkError (RuntimeError)        a user's function makes no network: it raises, or hangs
    ├── CompileError (ValueError)          a network cannot be put on the chip
    │   ├── RefusedError                   ... says its builder; nengo's BuildError too
    │   │   ├── InvalidError               ... of a parameter; nengo's ValidationError too
    │   │   └── DoesNotFitError            ... because it breaks limits: carries all violations
    │   │       └── NothingOnChipError     ... or since all of it runs on the host: no fault
    │   └── OverBudgetError                ... within the user's budget: carries all violations
    ├── ImageError (ValueError)            an image file is foreign, truncated or altered
    ├── BackendError (RuntimeError)        a backend cannot run an image or input
    │   ├── BoardLostError                 ... a board does not answer, or ended the session
    │   └── RobotLostError                 ... a robot does not, restarted, or fell silent
    ├── WorkerLostError (RuntimeError)     a process that takes part in a computation ended
    ├── RenderError (RuntimeError)         no picture can be made on this machine
    └── DivergedError (ArithmeticError)    a simulation left the numbers it can work with

A message names the object, the rule, the amount used and the limit, and the cure. The command
line exits with the ``exit_code`` of an error's class: 1 where a network or a run failed, 2 where
the request itself cannot be met.

`UnreadableError` of `spikeport.reading.archive` is a `UsageError`; every other error can be
imported from here. `RefusedError` and the errors below it are Nengo's errors,
too, and are imported when they are first used: importing Nengo takes a second.
"""

import re
import site
import sysconfig
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from spikeport.compile.check.violation import (
        DoesNotFitError,
        NothingOnChipError,
        OverBudgetError,
    )
    from spikeport.compile.ground.refusal import ArgumentError, InvalidError, RefusedError

__all__ = [
    "ArgumentError",
    "BackendError",
    "BoardLostError",
    "ChipFileError",
    "CompileError",
    "DivergedError",
    "DoesNotFitError",
    "ImageError",
    "InvalidError",
    "MissingExtraError",
    "NetworkError",
    "NothingOnChipError",
    "OverBudgetError",
    "RefusedError",
    "RenderError",
    "RobotLostError",
    "SpikeportError",
    "UsageError",
    "WorkerLostError",
]

LONGEST = 2000
"""Most letters of a user's error that are printed."""
LIBRARIES = (
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    # The system's, if this environment has its packages, too, and the user's own.
    *site.getsitepackages(),
    site.getusersitepackages(),
)
"""Folders of installed modules."""
INSTALLED = ("<", *(f"{folder}/" for folder in LIBRARIES), f"{Path(__file__).parent}/")
"""Prefixes of the paths of files that are not the user's."""

_HOMES = {
    "ArgumentError": "spikeport.compile.ground.refusal",
    "DoesNotFitError": "spikeport.compile.check.violation",
    "InvalidError": "spikeport.compile.ground.refusal",
    "NothingOnChipError": "spikeport.compile.check.violation",
    "OverBudgetError": "spikeport.compile.check.violation",
    "RefusedError": "spikeport.compile.ground.refusal",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'spikeport.errors' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class SpikeportError(Exception):
    """Root of all errors that spikeport raises on purpose."""

    exit_code: ClassVar[int] = 1
    """The code that the command line exits with."""


class UsageError(SpikeportError, ValueError):
    """A name, key or value is not known; the message lists the known ones."""

    exit_code = 2


class MissingExtraError(SpikeportError, ImportError):
    """An optional package is absent; the message names the extra that brings it."""

    exit_code = 2


class ChipFileError(SpikeportError, ValueError):
    """A chip's TOML file is wrong; the message gives path and reason."""

    exit_code = 2


class NetworkError(SpikeportError, RuntimeError):
    """A user's function that makes a network raised an error, or took too long."""


class CompileError(SpikeportError, ValueError):
    """A network cannot be put on the chip."""


class ImageError(SpikeportError, ValueError):
    """An image file is foreign, truncated or altered."""

    exit_code = 2


class BackendError(SpikeportError, RuntimeError):
    """A backend cannot run an image or its input."""


class BoardLostError(BackendError):
    """A board does not answer in time, hung up or refused: the state of its neurons is gone."""


class RobotLostError(BackendError):
    """A robot at the end of a link does not answer in time, or restarted."""


class WorkerLostError(SpikeportError, RuntimeError):
    """A process that takes part in a computation ended before its work was done."""


class RenderError(SpikeportError, RuntimeError):
    """No picture can be made on this machine."""


class DivergedError(SpikeportError, ArithmeticError):
    """A simulation left the range of numbers it can work with."""


def printable(text: str, kept: str = "") -> str:
    r"""Return a text with unprintable characters escaped, as ``\n`` or ``\x07``.

    Parameters
    ----------
    text : str
        The text, e.g. of a label or a file.
    kept : str
        Characters that stay as they are, e.g. ``"\n"``.
    """
    return "".join(
        c if c.isprintable() or c in kept else c.encode("unicode_escape").decode() for c in text
    )


def unknown(kind: str, name: str, known: Iterable[str]) -> UsageError:
    """Return the error for a name that is not known, listing the known ones.

    Parameters
    ----------
    kind : str
        The kind of thing that was looked for, e.g. ``"backend"``.
    name : str
        The name that is not known.
    known : iterable of str
        The known names.
    """
    choices = ", ".join(sorted(known))
    return UsageError(f"unknown {kind} '{printable(name)}'; choose from: {choices}")


def in_words(error: BaseException) -> str:
    """Return type, text, notes and place of an error of a user's code.

    The user's class may fail to make the text.
    """
    try:
        text = "; ".join([str(error), *getattr(error, "__notes__", [])])
    except BaseException:
        return f"{type(error).__name__}, which has no text{_place(error)}"
    more = "..." if len(text) > LONGEST else ""
    return f"{type(error).__name__}: {text[:LONGEST]}{more}{_place(error)}"


def reason_of(error: OSError) -> str:
    """Return the reason of an error, without the source locations that Python's ssl adds."""
    return re.sub(r"^\[[^]]*\] |^_ssl\.c:\d+: | \(_ssl\.c:\d+\)$", "", error.strerror or str(error))


def _place(error: BaseException) -> str:
    """Return, in brackets, the last line of a user's code in the traceback of an error."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if not frame.filename.startswith(INSTALLED):
            path = Path(frame.filename)
            here = path.is_relative_to(Path.cwd())
            name = path.relative_to(Path.cwd()) if here else path
            return printable(f" ({name}, line {frame.lineno})")
    return ""
