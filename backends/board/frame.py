"""Frames of the link, and the splitter that finds them in a stream of bytes.

A frame is a head of 36 bytes, a body, and a CRC-32 behind each, all little-endian; docs/link.md has
the table. A damaged stream is searched for the next whole frame, so that one flipped bit costs one
frame. A head has a CRC of its own, because a length with a flipped bit could make the reader wait
for bytes that never come.
"""

import struct
import time
import zlib
from enum import IntEnum
from typing import NamedTuple

MAGIC = b"SPKL"
VERSION = 1
HEAD = struct.Struct("<4sBBHIQQII")
"""Magic, version, kind, flags, session, step, time of sending, length of body, time of the step."""
CRC = struct.Struct("<I")
CHECKED_HEAD = struct.Struct(f"{HEAD.format}I")
"""A head, and its CRC-32."""
BODY = CHECKED_HEAD.size
"""The place of the body's first byte."""
SMALLEST = BODY + CRC.size
MOST_BODY = 1 << 20
"""Bytes in the largest body; images and totals, which may be larger, go in several frames."""
MORE = 1
"""The flag of a frame whose content continues in the next frame."""


class Kind(IntEnum):
    """The kind of a frame; ``H`` frames are the host's, ``B`` frames the board's."""

    HELLO = 1  # H: the digest of the image, and the seed
    WELCOME = 2  # B: the chip is built and warm
    WANT_IMAGE = 3  # B: no image of that digest is known
    IMAGE = 4  # H: a piece of the image's file; `step` is its first byte
    STEP = 5  # H: spikes and learning errors of a step
    STATE = 6  # B: the state of the outputs after the step, and its counts
    ASK_TOTALS = 7  # H: a request for the messages of all steps
    TOTALS = 8  # B: a piece of the totals; `step` is its first byte
    REFUSAL = 9  # B: why the session ends, in words
    STOP = 10  # H: the session ends


class Frame(NamedTuple):
    """A frame.

    Attributes
    ----------
    kind : int
        A `Kind`, or another number if the frame is of an unknown kind.
    session, step : int
        The session, 0 before there is one, and the step that the frame belongs to.
    body : bytes
        The content.
    flags : int
        The bits that describe the body, by kind.
    lasted_us : int
        Time, in us, that the board took for the step: with the time of sending, which every frame
        has as well, a listener on the line can tell a slow board from a slow link.
    version : int
        The version of the link that the sender speaks.
    """

    kind: int
    session: int = 0
    step: int = 0
    body: bytes = b""
    flags: int = 0
    lasted_us: int = 0
    version: int = VERSION

    def encode(self) -> bytes:
        """Return the bytes of the frame."""
        head = HEAD.pack(
            MAGIC,
            self.version,
            self.kind,
            self.flags,
            self.session,
            self.step,
            time.monotonic_ns(),
            len(self.body),
            self.lasted_us,
        )
        crc, body_crc = zlib.crc32(head), zlib.crc32(self.body)
        return b"".join((head, CRC.pack(crc), self.body, CRC.pack(body_crc)))


class Splitter:
    """A finder of frames in the bytes that arrive.

    Attributes
    ----------
    bad : int
        Times that bytes were skipped because they were not a whole frame.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.bad = 0

    def feed(self, data: bytes | memoryview) -> None:
        """Add bytes that arrived."""
        self._buffer += data

    def next(self) -> Frame | None:
        """Return the next frame; None until more bytes arrive."""
        buffer = self._buffer
        while len(buffer) >= SMALLEST:
            head = CHECKED_HEAD.unpack_from(buffer)
            magic, version, kind, flags, session, step, _, length, lasted_us, crc = head
            if magic != MAGIC or length > MOST_BODY or crc != zlib.crc32(buffer[: HEAD.size]):
                self._skip()
            elif len(buffer) < SMALLEST + length:
                return None
            elif (body := self._body(BODY + length)) is not None:
                return Frame(kind, session, step, body, flags, lasted_us, version)
        return None

    def _body(self, end: int) -> bytes | None:
        """Take a frame off the stream; return its body, None if the body is damaged."""
        body = bytes(memoryview(self._buffer)[BODY:end])
        (crc,) = CRC.unpack_from(self._buffer, end)
        del self._buffer[: end + CRC.size]
        if crc == zlib.crc32(body):
            return body
        self.bad += 1
        return None

    def _skip(self) -> None:
        """Drop the bytes before the next magic, at least one."""
        found = self._buffer.find(MAGIC, 1)
        # the last bytes may be the beginning of a magic
        del self._buffer[: found if found > 0 else len(self._buffer) - len(MAGIC) + 1]
        self.bad += 1
