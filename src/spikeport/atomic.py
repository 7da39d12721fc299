"""Files that are written whole or not at all, and folders that one process writes at a time."""

import contextlib
import errno
import fcntl
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path

from spikeport.errors import UsageError

LONGEST_NAME = 200
"""Bytes of the longest file name: file systems hold 255, and a half-written file's name is longer
than its own."""
LONGEST_FOLDER = 255
"""Bytes of the longest name of a folder, by the limit of file systems."""
RESULTS = ("result.json", "sweep.json")
"""Files that only the folders of runs, evaluations and sweeps have."""
PART = ".part"
"""The ending of a file that is not yet whole; only an interrupted program leaves one behind."""
ELSEWHERE = (
    *(errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.EEXIST, errno.ENOTDIR, errno.ENAMETOOLONG),
)
"""Errors of making a file that another path cures; a full disk, not listed, has more cures."""


def is_leftover(path: Path) -> bool:
    """Return whether a file is one that an interrupted program left half written."""
    return path.name.startswith(".") and PART in path.suffixes


def check_output(option: str, path: Path, *reads: Path, suffix: str = "") -> None:
    """Refuse an output path that cannot be written, or where something else would be replaced.

    A path is refused if it is not a file, if the command reads it, if it is a file of another kind,
    or if its folder cannot be written into.

    Parameters
    ----------
    option : str
        The option that gave the path, for messages.
    path : Path
        The path.
    *reads : Path
        The files that the command reads.
    suffix : str
        The suffix of such files, e.g. ``.html``: a file that exists must have this suffix, or none.

    Raises
    ------
    UsageError
        Naming option and path.
    """
    check_folder(option, path, path.parent)
    # `Path.exists` raises for a name that is too long, and for a folder that cannot be searched.
    exists = os.path.exists(path)
    if len(os.fsencode(path.name)) > LONGEST_NAME:
        raise UsageError(
            f"{option} {path}: a name of more than {LONGEST_NAME} bytes; choose another"
        )
    if exists and not os.path.isfile(path):
        raise UsageError(f"{option} {path}: is not a file that can be replaced; choose another")
    for one in reads:
        if exists and os.path.exists(one) and path.samefile(one):
            raise UsageError(
                f"{option} {path}: would replace what the command reads; choose another"
            )
    if suffix and exists and path.suffix not in ("", suffix):
        raise UsageError(f"{option} {path}: exists, and is not a {suffix} file; choose another")


def check_apart(outputs: Iterable[tuple[str, Path]]) -> None:
    """Refuse outputs that would replace each other.

    Parameters
    ----------
    outputs : iterable of (str, Path)
        The options that ask for outputs, or names of other writers, and their paths.

    Raises
    ------
    UsageError
        Naming both options, and the path.
    """
    known: dict[str, str] = {}  # `Path.resolve` raises for links in a circle
    for option, path in outputs:
        if (other := known.setdefault(os.path.realpath(path), option)) != option:
            raise UsageError(f"{option} {path}: would replace what {other} writes; choose another")


def check_results_folder(option: str, path: Path) -> None:
    """Refuse a folder for outputs that is a file or a run's, or that cannot be written into.

    Raises
    ------
    UsageError
        Naming option and path.
    """
    if os.path.exists(path) and not os.path.isdir(path):
        raise UsageError(f"{option} {path}: is a file; choose a folder")
    check_folder(option, path, path)
    # Whatever else is written there seems to be of the run.
    if held := [name for name in RESULTS if os.path.exists(path / name)]:
        raise UsageError(f"{option} {path}: holds a run, {held[0]}; choose another folder")


def check_folder(option: str, path: Path, folder: Path) -> None:
    """Refuse an output path whose folder cannot be written into, or made.

    Raises
    ------
    UsageError
        Naming option, path, and the folder that is there.
    """
    if any(len(os.fsencode(part)) > LONGEST_FOLDER for part in folder.parts):
        raise UsageError(
            f"{option} {path}: a folder's name of more than {LONGEST_FOLDER} bytes; choose another"
        )
    # The nearest one that exists: `os.path.exists` is false, too, for one that cannot be accessed.
    there = next((one for one in (folder, *folder.parents) if os.path.exists(one)), folder)
    if os.path.exists(there) and not os.path.isdir(there):
        raise UsageError(f"{option} {path}: {there} is no folder; choose another")
    if not os.access(there, os.W_OK | os.X_OK):
        raise UsageError(
            f"{option} {path}: the folder {there} cannot be written into; choose another"
        )


@contextlib.contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` that takes its place when the block ends well.

    The file is flushed to disk before it is renamed; on an error it is removed, and the old file at
    ``path`` stays as it was. Several threads may write one path: the last one wins.

    Raises
    ------
    UsageError
        If a folder, a pipe or a device is there: renaming would remove a device for everybody; or
        if nothing can be written there.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise UsageError(f"{path}: is not a file that can be replaced; choose another")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = _made_anew(path)
    except OSError as error:
        if error.errno in ELSEWHERE:
            raise UsageError(
                f"{path}: cannot be written ({error.strerror}); choose another place"
            ) from None
        error.filename = str(path)
        raise
    try:
        yield temporary
        with open(temporary, "rb") as file:
            # On disk before it is renamed: a power cut leaves the old file, or the whole new one.
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        # A full disk is reported without a name, other errors with one that no user knows.
        if error.filename in (None, str(temporary), temporary):
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _made_anew(path: Path) -> Path:
    """Return a new empty file beside a path, never a file or link that others put there."""
    while True:
        temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{PART}")
        with contextlib.suppress(FileExistsError):
            # With the rights of any new file: files of `tempfile` are for the owner alone.
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
            return temporary


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which ends with the process at the latest.

    Raises
    ------
    UsageError
        If another process, or another thread, holds it.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        if not lock(descriptor):
            raise UsageError(
                f"{folder}: another process writes into it; wait until it ends, or choose "
                "another --out"
            )
        yield
    finally:
        os.close(descriptor)


def lock(descriptor: int) -> bool:
    """Lock an open file or folder until it is closed; False if somebody else holds its lock."""
    # Some network file systems have no locks: there, nobody is refused.
    with contextlib.suppress(OSError):
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; names of files in it need not be UTF-8."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")
