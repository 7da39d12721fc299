"""Untrusted zip archives: nothing is extracted, and no member inflates beyond a limit."""

import io
import os
import stat
import struct
import zipfile
import zlib
from collections import Counter
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from spikeport.errors import UsageError
from spikeport.reading.mismatch import MismatchError, first_line

MOST_NUMBERS = 2**23
"""Most numbers in a policy's array: forty times a whole large walking policy (512, 256, 128)."""

FILE_BYTES = 4 * 8 * MOST_NUMBERS
"""Largest file that is read, 256 MiB: float64 weights, and the optimizer's three for each."""

DIRECTORY_BYTES = 2**20
"""Largest list of members, some 10,000: zipfile makes an object of each before any is refused."""

COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compressions that torch and NumPy write."""

DAMAGES = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    NotImplementedError,  # a version or a flag that zipfile does not know
    OSError,  # a seek to an impossible place in memory
    RuntimeError,  # the archive asks for a password
    ValueError,
)
"""Errors that zipfile raises for a damaged archive in memory."""


class UnreadableError(UsageError):
    """A file is missing or cannot be read; ``reason`` says which."""

    def __init__(self, path: Path, error: OSError) -> None:
        missing = isinstance(error, FileNotFoundError)
        self.reason = "no such file" if missing else f"cannot be read: {error.strerror}"
        super().__init__(f"{path}: {self.reason}")


def read_bytes(path: Path, limit: int = FILE_BYTES) -> bytes:
    """Return the content of a file.

    Raises
    ------
    UnreadableError
        If it is missing, a folder, or not readable.
    MismatchError
        If it is not a regular file (a pipe may never end), or larger than the limit.
    """
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > limit:
            raise MismatchError(f"a file of at most {limit:,} bytes", f"{size:,}")
        try:
            return file.read(size)  # `read(limit)` would first allocate the limit
        except OSError as error:
            raise UnreadableError(path, error) from None


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading.

    Raises
    ------
    UnreadableError
        If it is missing, a folder, or not readable.
    MismatchError
        If it is not a regular file: a pipe may never end.
    """
    try:
        file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115
    except OSError as error:
        raise UnreadableError(path, error) from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise MismatchError("a file", "a pipe or a device")
    return file


def _without_waiting(path: str, flags: int) -> int:
    """Open a file. A pipe is opened at once, too, even if nobody writes into it."""
    return os.open(path, flags | os.O_NONBLOCK)


class Archive:
    """A zip archive in memory.

    Parameters
    ----------
    content : bytes
        The file.
    limit : int
        Most bytes that the members which are read may inflate to, together.

    Raises
    ------
    MismatchError
        If it is damaged or too large, or a member's name occurs twice or leads out of it.
    """

    def __init__(self, content: bytes, limit: int = FILE_BYTES) -> None:
        _check_directory(content)
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except DAMAGES as error:
            raise _damaged(error) from error
        self._limit, self._inflated = limit, 0
        self._members = {info.filename: info for info in self._zip.infolist()}
        _check_names([info.filename for info in self._zip.infolist()])

    @property
    def size(self) -> int:
        """The number of bytes that all members inflate to, according to their list."""
        return sum(info.file_size for info in self._members.values())

    @property
    def names(self) -> list[str]:
        """The names of all members."""
        return list(self._members)

    def read(self, name: str, limit: int) -> bytes:
        """Return a member of at most ``limit`` bytes; MismatchError if it is missing or damaged."""
        if name not in self._members:
            raise MismatchError(f"a member {name}", "none")
        info = self._members[name]
        if info.compress_type not in COMPRESSIONS:
            raise MismatchError(f"{name} stored or deflated", f"compression {info.compress_type}")
        if info.file_size > limit:
            raise MismatchError(f"at most {limit:,} bytes in {name}", f"{info.file_size:,}")
        self._inflated += info.file_size
        if self._inflated > self._limit:
            raise MismatchError(f"at most {self._limit:,} bytes in all members together", "more")
        try:
            # with a size: without it, zipfile inflates all data before it cuts the rest off
            with self._zip.open(info) as member:
                content = member.read(info.file_size + 1)
        except DAMAGES as error:
            raise _damaged(error) from error
        if len(content) != info.file_size:
            raise MismatchError(f"{info.file_size:,} bytes in {name}", f"{len(content):,}")
        return content


def _damaged(error: Exception) -> MismatchError:
    return MismatchError("a whole zip archive", first_line(error))


def _check_names(names: list[str]) -> None:
    (name, count), *_ = Counter(names).most_common(1) or [("", 1)]
    if count > 1:
        raise MismatchError("members of different names", f"{count} of {name}")
    for name in names:
        if name.startswith("/") or "\\" in name or ".." in PurePosixPath(name).parts:
            raise MismatchError("members inside the archive", name)


def _check_directory(content: bytes) -> None:
    """Refuse a list of members that is too long, before zipfile reads it."""
    end = len(content) - 22
    if content[end : end + 4] != b"PK\5\6" or content[-2:] != b"\0\0":
        end = content.rfind(b"PK\5\6", max(0, end - 2**16))
    if end < 0:
        raise MismatchError("a whole zip archive", "one without a list of members")
    size = int.from_bytes(content[end + 12 : end + 16], "little")
    if end >= 20 and content[end - 20 : end - 16] == b"PK\6\7":
        size = _long_size(content, end)
    if size > DIRECTORY_BYTES:
        raise MismatchError(f"a list of members of at most {DIRECTORY_BYTES:,} bytes", f"{size:,}")


def _long_size(content: bytes, end: int) -> int:
    """Return the size of a list of members from ZIP64's record, which the locator at ``end`` names.

    Some versions of Python read the record before the locator, others the one at its offset: an
    archive has to mean the same one.
    """
    start = end - 76
    offset = int.from_bytes(content[end - 12 : end - 4], "little")
    if offset != start or content[start : start + 4] != b"PK\6\6":
        raise MismatchError("ZIP64's record directly before its locator", "it elsewhere")
    return int.from_bytes(content[start + 40 : start + 48], "little")
