"""The network that a worker made last, kept for the next points that need it."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import Generic, Protocol, TypeVar


class Closable(Protocol):
    """An object with resources."""

    def close(self) -> None:
        """Free the resources."""


C = TypeVar("C", bound=Closable)


class Keeper(threading.local, Generic[C]):
    """A place for one object with a key; each thread, and so each worker, has its own."""

    def __init__(self) -> None:
        self._key: object = None
        self.kept: C | None = None

    def get(self, key: object, make: Callable[[], C]) -> C:
        """Return the object of that key; if another one is kept, close it and make this one."""
        if self.kept is None or self._key != key:
            self.drop()
            self._key, self.kept = key, make()
        return self.kept

    @contextlib.contextmanager
    def dropped_on_error(self) -> Iterator[None]:
        """Drop the object if the block fails: it may be closed, or in the middle of a step."""
        try:
            yield
        except BaseException:
            self.drop()
            raise

    def drop(self) -> None:
        """Close the object that is kept, if there is one."""
        kept, self.kept = self.kept, None
        if kept is not None:
            kept.close()
