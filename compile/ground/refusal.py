"""Refusals by nengo-loihi's builder as our errors, and its warnings passed on.

    CompileError
    └── RefusedError (nengo's BuildError)        the builder or discretiser refuses the network
        └── InvalidError (nengo's ValidationError)   ... since a parameter is not valid
    UsageError
    └── ArgumentError (nengo's ValidationError)  an argument of a compile or simulator is not valid

Each is Nengo's error of that kind too, so that code written for Nengo catches it.
"""

import contextlib
import re
import threading
import traceback
import warnings
from collections.abc import Iterator

from nengo.exceptions import BuildError, NengoException, ValidationError

from spikeport.errors import CompileError, UsageError, printable

ADDRESS = re.compile(r" at 0x[0-9a-f]+")
TURN = threading.RLock()
"""Held while a compile changes what all threads share: warning filters, nengo-loihi's modules."""


class RefusedError(CompileError, BuildError):
    """The error of a network that Nengo's builder, nengo-loihi's, or its discretiser refuses.

    Attributes
    ----------
    about : tuple of str
        The names of the objects that are refused, and of the ends of those that are connections.
    advice : str
        A last line of the message, on what else may help.
    """

    about: tuple[str, ...] = ()
    advice: str = ""

    def __str__(self) -> str:
        """Return message and advice; of a parameter, the message names object and attribute."""
        return "\n".join(filter(None, (Exception.__str__(self), self.advice)))


class InvalidError(RefusedError, ValidationError):
    """The error of a parameter that is not valid: ``attr`` of the object ``obj``."""


class ArgumentError(UsageError, ValidationError):
    """The error of an argument that is not valid; nengo's ValidationError too."""

    __str__ = Exception.__str__

    def __init__(self, name: str, value: object, expected: str) -> None:
        super().__init__(f"{name}={value!r}: expected {expected}", name)


def refused(about: tuple[str, ...], error: Exception, cure: str) -> RefusedError:
    """Return the error for a refusal by nengo-loihi, often an assertion without text.

    ``about`` holds the name of the object that is refused, then those of its ends.
    """
    message = (
        f"{about[0]}: nengo-loihi refuses it: {reason_of(error)}; cure: {cure}, or keep its "
        "ensembles on the host with net.config[ensemble].on_chip = False"
    )
    if isinstance(error, ValidationError):
        return concerning(about, InvalidError(message, error.attr, error.obj))
    return concerning(about, RefusedError(message))


def concerning(about: tuple[str, ...], error: RefusedError) -> RefusedError:
    """Return an error, with the names of what it is about."""
    error.about = tuple(about)
    return error


def reason_of(error: Exception) -> str:
    """Return the words of an error; of an assertion without any, the line that failed."""
    reason = printable(without_addresses(error))
    if not reason:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {where.name}: {where.line}"
    if isinstance(error, NengoException | NotImplementedError):
        return reason
    return f"{type(error).__name__}: {reason}"


def without_addresses(said: Exception | Warning | str) -> str:
    """Return a text without the memory addresses by which Nengo names objects without a label."""
    return ADDRESS.sub("", str(said))


@contextlib.contextmanager
def collected_warnings() -> Iterator[list[warnings.WarningMessage]]:
    """Collect all warnings; at the end pass on each once, from module ``spikeport.compile``.

    Threads take turns: warnings of one compile do not reach another.
    """
    with TURN, warnings.catch_warnings(record=True) as collected:
        warnings.simplefilter("always")
        yield collected
    for one in {without_addresses(one.message): one for one in collected}.values():
        warnings.warn_explicit(
            one.message, one.category, one.filename, one.lineno, "spikeport.compile"
        )
