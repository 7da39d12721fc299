"""Temporary folders of sweeps; a sweep removes the folders that killed ones left."""

import contextlib
import fcntl
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

PREFIX = "spikeport-sweep-"


@contextlib.contextmanager
def scratch_folder() -> Iterator[str]:
    """Make a temporary folder, lock it while it is used, and remove it with its content."""
    remove_leftovers()
    path, lock = _locked()
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        os.close(lock)


def remove_leftovers() -> None:
    """Remove the folders of sweeps that were killed: folders of this user without a lock."""
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            status = path.lstat()
            # The system's folder is shared: other users may have put something there by this name.
            if status.st_uid != os.getuid() or not stat.S_ISDIR(status.st_mode):
                continue
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path)
            finally:
                os.close(lock)


def _locked() -> tuple[str, int]:
    """Return a new folder and its lock, which the system releases when this process ends."""
    while True:
        path = tempfile.mkdtemp(prefix=PREFIX)
        lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(lock, fcntl.LOCK_EX)
        if os.path.isdir(path):
            return path, lock
        os.close(lock)  # another sweep took it for a leftover before it was locked
