"""The record of a session: an append-only file of what the host sent and received in each step.

Every entry has its length, its kind and a CRC-32, so that a file that was cut anywhere is read to
the last whole entry. Entries are steps of the host, not frames of the link: a step whose outputs
were held because the board was late is recorded and played back as such.
"""

import json
import struct
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from enum import IntEnum
from io import BufferedWriter, FileIO
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pydantic import TypeAdapter, ValidationError

from spikeport.atomic import lock
from spikeport.backends.board.hello import Hello, Welcome
from spikeport.errors import BackendError, UsageError
from spikeport.reading.archive import open_file
from spikeport.reading.mismatch import MismatchError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

MAGIC = b"SPKLREC1"
ENTRY = struct.Struct("<IB3x")
CRC = struct.Struct("<I")
STEP = struct.Struct("<QIBB2x")
"""Step of the board, bytes of the host's body, its flags, and 1 if the board answered."""
MOST = 1 << 28
"""Bytes in the largest entry."""
FLUSH_S = 0.2
"""Time after which entries are handed to the system: a program that is killed loses no more.

A number of steps would not do: a slow board would hold its steps back for long, and a fast loop
would pay for a call in every step.
"""


class Entry(IntEnum):
    """The kind of an entry."""

    SESSION = 1
    STEP = 2
    TOTALS = 3


class RecordedStep(NamedTuple):
    """A step of the host.

    Attributes
    ----------
    board_step, flags, sent : int, int, bytes
        The step that the board was in, and the flags and body of the host. In real time, a body
        is not sent while the board is still in an earlier step.
    answer : bytes or None
        The board's answer; None if the last outputs were held.
    totals : bytes or None
        The totals up to this step, if the host asked for them.
    """

    board_step: int
    flags: int
    sent: bytes
    answer: bytes | None
    totals: bytes | None


class _NamedFile(FileIO):
    """A file whose errors have its name, which Python's error of a full disk lacks."""

    def write(self, data: "ReadableBuffer") -> int:
        """Write bytes, and return how many were written."""
        try:
            return super().write(data)
        except OSError as error:
            error.filename = self.name
            raise


class SessionRecorder:
    """A writer of records.

    Parameters
    ----------
    path : Path
        The file; an earlier record in it is replaced once a session begins.

    Raises
    ------
    UsageError
        If another session is recorded in it, or it is not a record.
    """

    def __init__(self, path: Path) -> None:
        if path.exists() and not _may_be_replaced(path):
            raise UsageError(
                f"--record {path}: is not a record, and would be replaced; choose another file"
            )
        self._path, self._is_earlier = path, path.exists()
        # Open to append: an earlier record stays until there is a session to replace it.
        self._file = BufferedWriter(_NamedFile(str(path), "ab"), 1 << 16)
        self._flush_s = 0.0
        if not lock(self._file.fileno()):
            self.close()
            raise UsageError(
                f"--record {path}: another session is recorded in it; choose another file"
            )

    def begin(self, hello: Hello, welcome: Welcome) -> None:
        """Write the greetings of both sides, in place of an earlier record."""
        self._file.truncate(0)
        self._is_earlier = False
        self._file.write(MAGIC)
        self._add(Entry.SESSION, json.dumps({**asdict(hello), **asdict(welcome)}).encode())
        self._flush()

    def step(self, board_step: int, flags: int, sent: bytes, answer: bytes | None) -> None:
        """Write a step of the host."""
        head = STEP.pack(board_step, len(sent), flags, answer is not None)
        self._add(Entry.STEP, b"".join((head, sent, answer or b"")))
        if time.monotonic() >= self._flush_s:
            self._flush()

    def _flush(self) -> None:
        self._file.flush()
        self._flush_s = time.monotonic() + FLUSH_S

    def _add(self, kind: Entry, payload: bytes) -> None:
        head = ENTRY.pack(len(payload), kind)
        # The CRC includes the head, so that a damaged length is found.
        crc = CRC.pack(zlib.crc32(payload, zlib.crc32(head)))
        self._file.write(b"".join((head, crc, payload)))

    def totals(self, body: bytes) -> None:
        """Write totals that the host asked for; totals of a step's end come before its entry."""
        self._add(Entry.TOTALS, body)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def discard(self) -> None:
        """Delete the file, unless it is still an earlier record, and close it."""
        # Delete it while it is locked: after that, it may be another session's.
        if not self._is_earlier:
            self._path.unlink(missing_ok=True)
        self.close()


def _may_be_replaced(path: Path) -> bool:
    """Return whether a file is empty, or an earlier record; a pipe or a device is no file."""
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return file.read(len(MAGIC)) in (b"", MAGIC)


class RecordedSession(NamedTuple):
    """The session of a record."""

    digest: str
    seed: int
    runs: str
    steps_per_s: float


class Record:
    """A record that is read.

    Parameters
    ----------
    path : Path
        The file.

    Attributes
    ----------
    session : RecordedSession
        Image, seed and machine.
    totals : bytes or None
        The totals at the end; None before the end is read, and for an interrupted session.
    whole : bool
        True if the file ends where an entry ends; False before the end is read.

    Raises
    ------
    UsageError
        If the file is missing or is not a record.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = open_file(path)
        except MismatchError as error:
            raise UsageError(f"{path}: {error}") from None
        self.totals: bytes | None = None
        self.whole = False
        self._entries = self._read()
        self.session = self._session()

    def _session(self) -> RecordedSession:
        kind, payload = next(self._entries, (None, b""))
        try:
            if kind == Entry.SESSION:
                return TypeAdapter(RecordedSession).validate_json(payload)
        except ValidationError:
            pass
        raise UsageError(f"{self._path}: no record of a board's session")

    def _read(self) -> Iterator[tuple[int, bytes]]:
        """Yield entries, up to the first that is cut or damaged."""
        with self._file as file:
            if file.read(len(MAGIC)) != MAGIC:
                return
            while len(head := file.read(ENTRY.size)) == ENTRY.size:
                length, kind = ENTRY.unpack(head)
                crc = file.read(CRC.size)
                payload = file.read(length) if length <= MOST else b""
                if len(payload) < length or len(crc) < CRC.size:
                    return
                if CRC.unpack(crc)[0] != zlib.crc32(payload, zlib.crc32(head)):
                    return
                yield kind, payload
            # Bytes that remain are the beginning of an entry that was cut off.
            self.whole = not head

    def steps(self) -> Iterator[RecordedStep]:
        """Yield the steps, once; BackendError if entries are of several sessions, or no steps."""
        totals, at = None, 0
        for kind, payload in self._entries:
            if kind == Entry.TOTALS:
                totals = payload
            elif kind == Entry.STEP:
                if len(payload) < STEP.size:
                    raise BackendError(f"{self._path}: a step of {len(payload)} bytes is cut")
                step = _step(payload, totals)
                if step.board_step < at:
                    raise BackendError(
                        f"{self._path}: step {step.board_step:,} after step {at:,}: several "
                        "sessions in one file; record it anew"
                    )
                yield step
                totals, at = None, step.board_step
            else:
                raise BackendError(f"{self._path}: an entry of kind {kind} among the steps")
        self.totals = totals

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _step(payload: bytes, totals: bytes | None) -> RecordedStep:
    board_step, size, flags, answered = STEP.unpack_from(payload)
    end = STEP.size + size
    answer = payload[end:] if answered else None
    return RecordedStep(board_step, flags, payload[STEP.size : end], answer, totals)
