"""Results that workers of a sweep share: one makes a result, and others that need it wait."""

import contextlib
import fcntl
import os
import secrets
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from spikeport import cache
from spikeport.cache import LOCK, Arrays, Cache
from spikeport.digest import digest_of


class Store(Cache):
    """A cache in which one process makes a result at a time, while others wait for it.

    A lock ends with the process that holds it, so a worker that dies leaves its work to the next.
    On a file system without locks, or one that is full, no process waits: some results are then
    made more than once, and are the same.
    """

    def kept(self, kind: str, inputs: object, make: Callable[[], Arrays]) -> Arrays:
        """Return the arrays kept under ``inputs``, else make and keep them; see `Cache.kept`."""
        with self._alone(f".{kind}-{digest_of((kind, inputs))[:32]}{LOCK}"):
            return super().kept(kind, inputs, make)

    @contextlib.contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        """Wait until no other process is in the block of that name."""
        lock = None
        with contextlib.suppress(OSError):
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            lock = _locked(self.folder / name)
        try:
            yield
        finally:
            if lock is not None:
                with contextlib.suppress(OSError):
                    # Removed while it is locked: a waiting process notices this, and makes another.
                    (self.folder / name).unlink()
                os.close(lock)


@dataclass(frozen=True)
class Sharing:
    """Base of the runners of points, sent to each worker; chooses the place of shared results.

    Attributes
    ----------
    sweep : str
        A text that no other sweep has: a worker of a cluster may run several sweeps.
    keeps : bool
        True if the user's cache is used; else only the workers of a folder share results.
    """

    sweep: str
    keeps: bool

    @classmethod
    def new(cls) -> Self:
        """Return the runner of a new sweep."""
        return cls(secrets.token_hex(8), os.environ.get(cache.FOLDER) != cache.OFF)

    def store(self, scratch: str) -> Store:
        """Return the store of a worker whose folder is ``scratch``."""
        kept = cache.of_user()
        if self.keeps and kept is not cache.NOTHING:
            return Store(kept.folder)
        return Store(Path(scratch) / f"store-{self.sweep}")


def _locked(path: Path) -> int:
    """Return the descriptor of a locked file at a path."""
    while True:
        lock = os.open(path, os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
        try:
            if _taken(lock, path):
                return lock
        except OSError:
            os.close(lock)
            raise
        os.close(lock)  # its previous holder has removed it


def _taken(lock: int, path: Path) -> bool:
    """Wait for the lock of an open file; return whether the file is still at its path."""
    fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        return os.path.samestat(os.fstat(lock), path.stat())
    except FileNotFoundError:
        return False
