"""Refusals by nengo-loihi's builder, raised as our errors.

    CompileError
    └── RefusedError (nengo's BuildError)        the builder or discretiser refuses the network
        └── InvalidError (nengo's ValidationError)   ... since a parameter is not valid
    UsageError
    └── ArgumentError (nengo's ValidationError)  an argument of a compile or simulator is not valid

Each error is also the error of Nengo in brackets, so that code written for Nengo catches it.
"""

import contextlib
import re
import traceback
from collections.abc import Iterator

from nengo.exceptions import BuildError, NengoException, ValidationError

from spikeport.errors import CompileError, UsageError, printable

CYCLES = "Input graph has cycles"
"""Nengo's words for loops of connections without a synapse; they name no object."""
CYCLE_CURE = (
    "give a connection of each loop a synapse, as in synapse=nengo.Lowpass(0.001) (`spikeport "
    "compile` names loops on the chip, SP416)"
)
NENGOS_TOO = "Applying a sparse transform to a decoded connection"
"""A refusal of nengo-loihi's that Nengo makes too; only a network that is rewritten avoids it."""
ADDRESS = re.compile(r" at 0x[0-9a-f]+")


class RefusedError(CompileError, BuildError):
    """The error of a network that Nengo's builder or nengo-loihi's builder or discretiser refuses.

    Attributes
    ----------
    about : tuple of str
        The names of the objects that are refused, and of the ends of connections among them.
    advice : str
        The last line of the message: what else may help.
    everywhere : bool
        True if the network would also be refused on the host, or rewritten.
    """

    about: tuple[str, ...] = ()
    advice: str = ""
    everywhere: bool = False

    def __str__(self) -> str:
        """Return message and advice; the message already names the object and attribute."""
        return "\n".join(filter(None, (Exception.__str__(self), self.advice)))


class InvalidError(RefusedError, ValidationError):
    """The error of a parameter that is not valid: ``attr`` of the object ``obj``."""


class ArgumentError(UsageError, ValidationError):
    """The error of an argument that is not valid; nengo's ValidationError too."""

    __str__ = Exception.__str__

    def __init__(self, name: str, value: object, expected: str) -> None:
        super().__init__(f"{name}={value!r}: expected {expected}", name)


def refused(about: tuple[str, ...], error: Exception, cure: str) -> RefusedError:
    """Return the error for a refusal by a builder, often an assertion without text.

    ``about`` holds the name of the object that is refused, then the names of its ends.
    """
    everywhere = _is_nengos(error)
    message = (
        f"{about[0]}: {'Nengo' if everywhere else 'nengo-loihi'} refuses it: {reason_of(error)}; "
        f"cure: {cure}"
    )
    if not everywhere and NENGOS_TOO not in str(error):
        message += (
            ", or keep its ensembles on the host with net.config[ensemble].on_chip = False, after "
            "spikeport.add_params(net)"
        )
    found = RefusedError(message)
    if isinstance(error, ValidationError):
        found = InvalidError(message, error.attr, error.obj)
    found.everywhere = everywhere
    return concerning(about, found)


def _is_nengos(error: Exception) -> bool:
    """Return whether Nengo's own code, or user code that Nengo called, raised an error.

    The host would raise the same error, whatever is on the chip. nengo-loihi's copies of Nengo's
    builders of ensembles and decoders have the same checks, and count as Nengo's. Objects that
    nengo-loihi makes in place of passthrough nodes are its own, whichever code refuses them.
    """
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    names = [(one.f_globals.get("__name__", ""), one.f_code.co_name) for one in frames]
    if any(module == "nengo_loihi.passthrough" for module, _ in names):
        return False
    module, function = next(
        (name for name in reversed(names) if name[0].startswith(("nengo.", "nengo_loihi."))),
        ("", ""),
    )
    # These modules raise for objects that a builder lacks, which may be nengo-loihi's builder.
    lacks = module in ("nengo.builder.builder", "nengo.builder.probe")
    return (module.startswith("nengo.") and not lacks) or function in (
        "get_gain_bias",
        "build_ensemble",
        "build_decoders",
    )


@contextlib.contextmanager
def refused_in_float(beside_chip: bool) -> Iterator[None]:
    """Turn an error of ordinary Nengo, while it builds a network, into a refusal in words.

    If it is built beside the chip, to compare, the chip may run alone.
    """
    try:
        yield
    except NengoException as error:
        reason = reason_of(error)
        cure = CYCLE_CURE if CYCLES in reason else "change the network accordingly"
        alone = ", or do not compare: `simulate --no-float`, or `compile` without --loss"
        message = (
            f"ordinary Nengo refuses the network: {reason.rstrip('.')}; cure: {cure}"
            f"{alone if beside_chip else ''}"
        )
        if isinstance(error, ValidationError):
            raise InvalidError(message, error.attr, error.obj) from error
        raise RefusedError(message) from error


def concerning(about: tuple[str, ...], error: RefusedError) -> RefusedError:
    """Return an error, with the names of the objects that it is about."""
    error.about = tuple(about)
    return error


def reason_of(error: Exception) -> str:
    """Return the text of an error; for a division by zero, or one without text, the line."""
    reason = printable(without_addresses(error))
    if not reason or isinstance(error, ZeroDivisionError):
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {where.name}: {where.line}"
    if isinstance(error, NengoException | NotImplementedError):
        return reason
    return f"{type(error).__name__}: {reason}"


def without_addresses(message: Exception | Warning | str) -> str:
    """Return a text without the memory addresses by which Nengo names objects without a label."""
    return ADDRESS.sub("", str(message))
