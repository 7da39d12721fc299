"""A line: frames over a socket, with limits of time."""

import select
import socket
import ssl
import struct
import time
from typing import Protocol

from spikeport.backends.board.frame import Frame, Splitter
from spikeport.errors import BoardLostError, reason_of

CHUNK = 1 << 18
NOT_YET = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)
SYSTEM_WAITS_S = 0.2
"""Time that reading a plain socket waits for bytes; a `select` before it costs another call."""
SYSTEM_WAITS = struct.pack("ll", 0, int(1e6 * SYSTEM_WAITS_S))
SEND_S = 5.0
"""Time in which the other side must read a frame; buffers of the system hold hundreds of frames."""


class Line(Protocol):
    """Frames to and from the other side."""

    def send(self, frame: Frame) -> None:
        """Send a frame; BoardLostError if the other side hung up."""

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame, or None if none came in time.

        Raises
        ------
        BoardLostError
            If the other side hung up.
        """

    @property
    def bad(self) -> int:
        """The number of times that bytes were skipped, because they were not a frame."""

    def close(self) -> None:
        """Hang up."""


class SocketLine:
    """Frames over a socket. Implements `Line`.

    Parameters
    ----------
    connected : socket
        A stream socket, with or without TLS.
    name : str
        The name of the other side, for messages.

    Attributes
    ----------
    is_gone : bool
        True once the other side hung up.
    """

    def __init__(self, connected: socket.socket, name: str) -> None:
        self._socket, self._name = connected, name
        self.is_gone = False
        self._tls = connected if isinstance(connected, ssl.SSLSocket) else None
        connected.setblocking(self._tls is None)
        for timeout in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            connected.setsockopt(socket.SOL_SOCKET, timeout, SYSTEM_WAITS)
        self._chunk = memoryview(bytearray(CHUNK))
        self._splitter = Splitter()

    @property
    def bad(self) -> int:
        """The number of times that bytes were skipped, because they were not a frame."""
        return self._splitter.bad

    def send(self, frame: Frame) -> None:
        """Send a frame; BoardLostError if the other side hung up."""
        self.send_bytes(frame.encode())

    def send_bytes(self, data: bytes) -> None:
        """Send bytes as they are."""
        left = memoryview(data)
        while left:
            try:
                left = left[self._socket.send(left) :]
            except NOT_YET:
                if not select.select([], [self._socket], [], SEND_S)[1]:
                    raise self._lost("it does not read") from None
            except OSError as error:
                raise self._lost(reason_of(error)) from None

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame, or None if none came in time; see `Line.receive`."""
        end = time.perf_counter() + within_s
        while (frame := self._splitter.next()) is None:
            left = end - time.perf_counter()
            if not self._may_take(left):
                return None
            self._take()
            if left <= 0:  # else a peer that sends on, and no frame, would hold its reader
                return self._splitter.next()
        return frame

    def _may_take(self, within_s: float) -> bool:
        """Return True if bytes are there or come in time, or if reading can wait for them."""
        if self._tls is None and within_s > SYSTEM_WAITS_S:
            return True
        if self._tls is not None and self._tls.pending() > 0:  # bytes that select does not see
            return True
        if self._socket.fileno() < 0:
            raise self._lost("it is closed")
        # poll() would round up to whole milliseconds: a step of real time takes one
        return bool(select.select([self._socket], [], [], max(0.0, within_s))[0])

    def _take(self) -> None:
        """Take bytes off the socket, if there are any."""
        try:
            n = self._socket.recv_into(self._chunk)
        except NOT_YET:
            return
        except OSError as error:
            raise self._lost(reason_of(error)) from None
        if n == 0:
            raise self._lost("it hung up")
        self._splitter.feed(self._chunk[:n])

    def _lost(self, reason: str) -> BoardLostError:
        self.is_gone = True
        return BoardLostError(f"{self._name}: the link is gone ({reason})")

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
