"""Results that are kept from run to run, each under a digest of everything that decides it.

An entry is a file of arrays, named by the digest of its key. The key has the inputs of a result and
its surroundings: spikeport's own files, the packages that compute, the kind of processor and its
threads, since all of them decide the bits. So an entry is never out of date: a change makes another
key.
"""

import contextlib
import math
import os
import platform
import re
import stat
import sys
import time
import warnings
import zipfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import IO, Any, NamedTuple, TypeAlias

import numpy as np
from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

from spikeport import __version__
from spikeport.atomic import PART, atomic_path
from spikeport.digest import digest_of
from spikeport.errors import UsageError
from spikeport.extras import version_of
from spikeport.reading import npz
from spikeport.reading.archive import FILE_BYTES
from spikeport.reading.mismatch import MismatchError

FOLDER = "SPIKEPORT_CACHE"
"""Environment variable: the folder to use instead of the user's own, or `OFF`."""
OFF = "off"
LIMIT_BYTES = 2**30
"""Most bytes of all entries together; the oldest entries are removed first."""
ENTRY_BYTES = FILE_BYTES + 2**22
"""The largest entry, in bytes: arrays of `FILE_BYTES`, even a single array, and their headers."""
HALF_WRITTEN_AGE_S = 24 * 3600.0
"""Age from which a half-written entry, or a lock, counts as left by a killed process."""
SEAL = "seal"
"""The name of an entry's array that holds the digest of its key and its other arrays."""
# Their versions, and how the linear algebra library adds up, decide the last bits of results.
COMPUTING = ("numpy", "scipy", "nengo", "nengo-loihi", "numba", "mujoco")
BLAS = ("internal_api", "version", "num_threads", "architecture", "threading_layer")
OURS = (".py", ".toml", ".xml", ".npz")
"""Files of spikeport that decide results: code, chips and settings, robots, policies."""

_DIGITS = 32
_NAME = re.compile(rf"[a-z-]+-[0-9a-f]{{{_DIGITS}}}\.npz")
"""The name of an entry: its kind, and so many digits of its key."""
LOCK = ".lock"
"""The ending of a file that a process locks while it makes an entry, see
`spikeport.experiments.sweep.store`."""
_LEFT_OVER = re.compile(
    rf"\.[a-z-]+-[0-9a-f]{{{_DIGITS}}}(\.npz\..*{re.escape(PART)}|{re.escape(LOCK)})"
)
"""The name of a half-written entry, or of such a lock."""

Arrays: TypeAlias = Mapping[str, np.ndarray]


class Entry(NamedTuple):
    """A kept result: its kind, bytes, and time of last change in s since 1970."""

    kind: str
    size: int
    changed_s: float
    path: Path


class Cache:
    """Results in a folder.

    Parameters
    ----------
    folder : Path
        The folder. It is made with mode 700 if missing, and not used if others can write into it.

    Notes
    -----
    A folder that cannot be used, a full disk or a damaged entry never ends a run: a warning says
    so once, and the result is made anew.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def kept(self, kind: str, inputs: object, make: Callable[[], Arrays]) -> Arrays:
        """Return the arrays kept under ``inputs``, else make and keep them.

        Parameters
        ----------
        kind : str
            The kind of result, in letters and hyphens: the file's name begins with it.
        inputs : object
            Everything that decides the result except its `surroundings`; see
            `spikeport.digest.digest_of`.
        make : callable
            Makes the arrays: numbers and texts.

        Raises
        ------
        TypeError
            If a value among the inputs has no identity that lasts.
        """
        key = digest_of((kind, inputs, surroundings()))
        # Half of the key names the file; the seal in it depends on the whole key.
        path = self.folder / f"{kind}-{key[:_DIGITS]}.npz"
        found = self._read(path, key)
        if found is None:
            found = dict(make())
            self._write(path, key, found)
        return found

    def entries(self) -> list[Entry]:
        """Return the kept entries, the oldest first."""
        found = []
        for path in self.folder.glob("*.npz"):
            if not _NAME.fullmatch(path.name):
                continue  # a user's own file, in a folder of their choice
            try:
                status = path.stat()
            except OSError:
                continue  # another process has just removed it
            kind = path.name.rpartition("-")[0]
            found.append(Entry(kind, status.st_size, status.st_mtime, path))
        return sorted(found, key=lambda entry: entry.changed_s)

    def clear(self) -> int:
        """Remove all entries, and left-overs; return the number of whole entries."""
        found = self.entries()
        for path in (*(entry.path for entry in found), *self._left_overs()):
            path.unlink(missing_ok=True)
        return len(found)

    def _left_overs(self, until_s: float = math.inf) -> list[Path]:
        """Return half-written entries and locks that killed processes left, older than a time."""
        found = []
        for path in self.folder.glob(".*"):
            with contextlib.suppress(FileNotFoundError):  # its process has just completed it
                if _LEFT_OVER.fullmatch(path.name) and path.stat().st_mtime <= until_s:
                    found.append(path)
        return found

    def _read(self, path: Path, key: str) -> dict[str, np.ndarray] | None:
        """Return the arrays of an entry; None if there is none that is whole."""
        try:
            self._check_private()
            return read(path, key) if path.exists() else None
        except FileNotFoundError:  # there is no folder yet
            return None
        except (OSError, UsageError) as error:  # equal for all entries if the folder is the cause
            _warn(str(error))
        except MismatchError as error:
            _warn(f"{path.name}: {error}")
        return None

    def _write(self, path: Path, key: str, arrays: dict[str, np.ndarray]) -> None:
        sealed: dict[str, Any] = {**arrays, SEAL: digest_of((key, arrays))}
        try:
            with contextlib.suppress(FileExistsError):  # a file: the check below refuses it
                self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._check_private()
            with atomic_path(path) as temporary, open(temporary, "wb") as file:
                _save(file, sealed)
            self._trim()
        except (OSError, UsageError) as error:
            _warn(str(error))

    def _check_private(self) -> None:
        """Raise UsageError if others can write into the folder: its numbers decide what runs.

        Also if it is no folder, as ``/dev/null``.
        """
        status = self.folder.stat()
        if not stat.S_ISDIR(status.st_mode):
            raise UsageError(f"{self.folder}: is no folder; cure: {FOLDER}={OFF}, or a folder")
        if status.st_uid != os.getuid() or stat.S_IMODE(status.st_mode) & 0o022:
            raise UsageError(
                f"{self.folder}: others can write into it; cure: chmod 700, or another {FOLDER}"
            )

    def _trim(self) -> None:
        """Remove old left-overs, and the oldest entries beyond the limit."""
        for path in self._left_overs(time.time() - HALF_WRITTEN_AGE_S):
            path.unlink(missing_ok=True)
        entries = self.entries()
        size = sum(entry.size for entry in entries)
        for entry in entries:
            if size <= LIMIT_BYTES:
                return
            entry.path.unlink(missing_ok=True)
            size -= entry.size


def _save(file: IO[bytes], arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays as `numpy.savez_compressed` does, a quarter larger, in a fifth of the time."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)


class Nothing(Cache):
    """A cache that keeps nothing."""

    def kept(self, kind: str, inputs: object, make: Callable[[], Arrays]) -> Arrays:
        """Make the arrays."""
        return make()


NOTHING = Nothing(Path())


def read(path: Path, key: str) -> dict[str, np.ndarray]:
    """Return the arrays of an entry.

    Raises
    ------
    MismatchError
        If the file is damaged, or the entry of another key.
    """
    arrays = npz.read(path, most=ENTRY_BYTES, limit=ENTRY_BYTES)
    if str(arrays.pop(SEAL, "")) != digest_of((key, arrays)):
        raise MismatchError("the stored arrays", "altered arrays, or another entry's")
    return arrays


def of_user() -> Cache:
    """Return the user's cache: in ``$SPIKEPORT_CACHE``, else in the folder usual for caches.

    If the variable is ``off``, as ``--no-cache`` sets it, the cache keeps nothing.
    """
    asked = os.environ.get(FOLDER)
    if asked == OFF:
        return NOTHING
    try:
        return Cache(Path(asked) if asked else _usual_folder())
    except RuntimeError as error:  # a user without a home folder
        _warn(str(error))
        return NOTHING


def switch_off() -> None:
    """Let `of_user` return a cache that keeps nothing, here and in processes that are started."""
    os.environ[FOLDER] = OFF


def _usual_folder() -> Path:
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(caches) / "spikeport"


def _warn(found: str) -> None:
    # Always from this line: Python shows a warning once for each line that it comes from.
    warnings.warn(f"cache: {found}; the result is made anew", stacklevel=1)


@cache
def surroundings() -> str:
    """Return a digest of everything, besides the inputs, that decides results.

    It covers spikeport's own files, the versions of Python and of the packages that compute, the
    processor, and the libraries of linear algebra with their kernels and threads, on which bits
    depend.
    """
    import scipy.linalg  # noqa: F401, loads a BLAS of its own, which has to be covered

    versions = {name: version_of(name) for name in COMPUTING}
    blas = sorted(
        [str(one.get(name)) for name in BLAS]
        for one in threadpool_info()
        if one["user_api"] == "blas"
    )
    return digest_of((own_version(), versions, sys.version, platform.machine(), blas))


@cache
def own_version() -> str:
    """Return spikeport's version and a digest of its files, which change without a new version."""
    ours = Path(__file__).parent
    files = [
        Path(folder, name)
        for folder, _, names in os.walk(ours, followlinks=True)
        for name in names
        # `os.walk`, since `Path.rglob` does not follow the links to the top folders. An editor's
        # lock file is a link to nothing, whose name begins with a dot.
        if name.endswith(OURS) and not name.startswith(".")
    ]
    code = {str(file.relative_to(ours)): file.read_bytes() for file in files}
    return f"{__version__}+{digest_of(code)[:12]}"
