"""Warnings of a compile, each with the objects that it is about, passed on once."""

import contextlib
import os
import threading
import warnings
from collections import defaultdict
from collections.abc import Iterator

from spikeport.compile.ground.refusal import without_addresses

MOST_NAMED = 3
"""The most objects that are named with a warning; further objects are only counted."""
TURN = threading.RLock()
"""A lock that a compile holds while it changes state of all threads: warning filters, nengo-loihi's
modules."""
# A forked child has one thread: it would wait for ever for a lock that another thread held.
os.register_at_fork(before=TURN.acquire, after_in_parent=TURN.release, after_in_child=TURN.release)


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
