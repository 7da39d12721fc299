"""Refusals by nengo-loihi's builder, raised as our errors, and its warnings, passed on.

    CompileError
    └── RefusedError (nengo's BuildError)        the builder or discretiser refuses the network
        └── InvalidError (nengo's ValidationError)   ... since a parameter is not valid
    UsageError
    └── ArgumentError (nengo's ValidationError)  an argument of a compile or simulator is not valid

Each error is also the error of Nengo in brackets, so that code written for Nengo catches it.
"""

import contextlib
import os
import re
import threading
import traceback
import warnings
from collections import defaultdict
from collections.abc import Iterator

from nengo.exceptions import BuildError, NengoException, ValidationError

from spikeport.errors import CompileError, UsageError, printable

MOST_NAMED = 3
"""The most objects that are named with a warning; further objects are only counted."""
CYCLES = "Input graph has cycles"
"""Nengo's words for loops of connections without a synapse; they name no object."""
CYCLE_CURE = (
    "give a connection of each loop a synapse, as in synapse=nengo.Lowpass(0.001) (`spikeport "
    "compile` names loops on the chip, SP416)"
)
ADDRESS = re.compile(r" at 0x[0-9a-f]+")
TURN = threading.RLock()
"""A lock that a compile holds while it changes state of all threads: warning filters, nengo-loihi's
modules."""
# A forked child has one thread: it would wait for ever for a lock that another thread held.
os.register_at_fork(before=TURN.acquire, after_in_parent=TURN.release, after_in_child=TURN.release)


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
    if not everywhere:
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
def refused_in_float() -> Iterator[None]:
    """Turn an error of ordinary Nengo, while it builds a network, into a refusal in words."""
    try:
        yield
    except NengoException as error:
        reason = reason_of(error)
        message = (
            f"ordinary Nengo refuses the network: {reason.rstrip('.')}; cure: "
            f"{CYCLE_CURE if CYCLES in reason else 'change the network accordingly'}, or run the "
            "chip alone with `simulate --no-float`"
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


class Notices:
    """Warnings of a compile, each with the object that it is about.

    Attributes
    ----------
    caught : list of WarningMessage
        The warnings, as they came.
    """

    def __init__(self, caught: list[warnings.WarningMessage]) -> None:
        self.caught = caught
        self._objects: dict[int, str] = {}

    @contextlib.contextmanager
    def about(self, name: str) -> Iterator[None]:
        """Attribute warnings of a block of code to an object, unless they belong to one already."""
        before = len(self.caught)
        try:
            yield
        finally:
            for number in range(before, len(self.caught)):
                self._objects.setdefault(number, name)

    def by_text(self) -> dict[str, warnings.WarningMessage]:
        """Return the first warning of each text, by this text and the objects that it is about."""
        first: dict[str, warnings.WarningMessage] = {}
        objects: dict[str, dict[str, None]] = defaultdict(dict)
        for number, one in enumerate(self.caught):
            text = without_addresses(one.message)
            first.setdefault(text, one)
            if number in self._objects:
                objects[text][self._objects[number]] = None
        return {_with_objects(text, list(objects[text])): one for text, one in first.items()}

    def texts(self) -> tuple[str, ...]:
        """Return each text once, in alphabetical order."""
        return tuple(sorted(self.by_text()))


def _with_objects(text: str, objects: list[str]) -> str:
    if not objects:
        return text
    more = len(objects) - MOST_NAMED
    named = ", ".join(objects[:MOST_NAMED])
    return f"{named} and {more} more: {text}" if more > 0 else f"{named}: {text}"


_OPEN: list[Notices] = []
"""The collections under way, the innermost last; `TURN` is held while there is any."""


@contextlib.contextmanager
def collected_warnings() -> Iterator[Notices]:
    """Collect all warnings; at the end pass on each once, from module ``spikeport.compile``.

    Threads take turns: warnings of one compile do not reach another.
    """
    with TURN, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _OPEN.append(Notices(caught))
        try:
            yield _OPEN[-1]
        finally:
            notices = _OPEN.pop()
    for text, one in notices.by_text().items():
        warnings.warn_explicit(text, one.category, one.filename, one.lineno, "spikeport.compile")


@contextlib.contextmanager
def ignored_warnings() -> Iterator[None]:
    """Drop the warnings of a trial compile: the compile of the choice issues its own."""
    with TURN, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def warnings_about(name: str) -> contextlib.AbstractContextManager[None]:
    """Return a context that attributes warnings to an object; the innermost context counts.

    An empty name attributes them to no object.
    """
    return _OPEN[-1].about(name) if _OPEN and name else contextlib.nullcontext()
