"""Every error spikeport raises on purpose.

    SpikeportError
    ├── UsageError (ValueError)            a name, key or value that is not known: lists what is
    ├── MissingExtraError (ImportError)    an optional package is absent: names the extra
    ├── ChipFileError (ValueError)         a chip's TOML is wrong: path and reason
    ├── CompileError (ValueError)          a network cannot be put on the chip
    │   ├── RefusedError                   ... says its builder; nengo's BuildError too
    │   │   ├── InvalidError               ... of a parameter; nengo's ValidationError too
    │   │   └── DoesNotFitError            ... because it breaks limits: carries all violations
    │   └── OverBudgetError                ... within the user's budget: carries all violations
    ├── ImageError (ValueError)            an image file is foreign, truncated or altered
    ├── BackendError (RuntimeError)        a backend cannot run what it was given
    ├── RenderError (RuntimeError)         no picture can be made on this machine
    └── DivergedError (ArithmeticError)    a simulation left the numbers it can work with

A message names the object, the rule, what was used against the limit, and the cure.
"""

from collections.abc import Iterable


class SpikeportError(Exception):
    """Root of all errors that spikeport raises on purpose."""


class UsageError(SpikeportError, ValueError):
    """A name, key or value is not known; the message lists what is."""


class MissingExtraError(SpikeportError, ImportError):
    """An optional package is absent; the message names the extra that brings it."""


class ChipFileError(SpikeportError, ValueError):
    """A chip's TOML file is wrong; the message gives path and reason."""


class CompileError(SpikeportError, ValueError):
    """A network cannot be put on the chip."""


class ImageError(SpikeportError, ValueError):
    """An image file is foreign, truncated or altered."""


class BackendError(SpikeportError, RuntimeError):
    """A backend cannot run what it was given."""


class RenderError(SpikeportError, RuntimeError):
    """No picture can be made on this machine."""


class DivergedError(SpikeportError, ArithmeticError):
    """A simulation left the range of numbers it can work with."""


def unknown(kind: str, name: str, known: Iterable[str]) -> UsageError:
    """The error for a name that is not known, listing the known ones.

    Parameters
    ----------
    kind : str
        What was looked for, e.g. ``"backend"``.
    name : str
        The name that was given.
    known : iterable of str
        The names there are.
    """
    return UsageError(f"unknown {kind} '{name}'; there is: {', '.join(sorted(known))}")
