"""A line: frames over a socket, within a time."""

import select
import socket
import ssl
import time
from collections.abc import Iterator
from typing import Protocol

from spikeport.backends.board.frame import Frame, Splitter
from spikeport.errors import BoardLostError

CHUNK = 1 << 18
NOT_YET = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)
SEND_S = 5.0
"""Time in which the other side must take a frame; buffers of the system hold hundreds of them."""


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
        """The number of times that bytes were skipped, because they were no frame."""

    def close(self) -> None:
        """Hang up."""


class SocketLine:
    """Frames over a socket. Implements `Line`.

    Parameters
    ----------
    connected : socket
        A stream socket, with or without TLS.
    name : str
        The other side, for messages.
    """

    def __init__(self, connected: socket.socket, name: str) -> None:
        connected.setblocking(False)  # waits are ours: a timeout of the socket costs a call each
        self._socket = connected
        self._splitter = Splitter()
        self._name = name

    def fileno(self) -> int:
        """Return the number by which selectors know the socket."""
        return self._socket.fileno()

    @property
    def bad(self) -> int:
        """The number of times that bytes were skipped, because they were no frame."""
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
                raise self._lost(error.strerror or str(error)) from None

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame, or None if none came in time; see `Line.receive`."""
        end = time.perf_counter() + within_s
        while (frame := self._splitter.next()) is None:
            if not self._has_arrived(max(0.0, end - time.perf_counter())):
                return None
            self._take()
        return frame

    def arrived(self) -> Iterator[Frame]:
        """Yield the frames in what has arrived; there is something, by a selector's word."""
        more = True
        while more:
            self._take()
            while (frame := self._splitter.next()) is not None:
                yield frame
            more = self._is_buffered()

    def _has_arrived(self, within_s: float) -> bool:
        """Return whether bytes are there, or come in time."""
        if self._socket.fileno() < 0:
            raise self._lost("it is closed")
        # poll() would round up to whole milliseconds, which is a step of real time
        return self._is_buffered() or bool(select.select([self._socket], [], [], within_s)[0])

    def _is_buffered(self) -> bool:
        """Return whether TLS holds bytes that a selector knows nothing of."""
        return isinstance(self._socket, ssl.SSLSocket) and self._socket.pending() > 0

    def _take(self) -> None:
        """Take bytes off the socket, if there are any."""
        try:
            data = self._socket.recv(CHUNK)
        except NOT_YET:
            return
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from None
        if not data:
            raise self._lost("it hung up")
        self._splitter.feed(data)

    def _lost(self, reason: str) -> BoardLostError:
        return BoardLostError(f"{self._name}: the link is gone ({reason})")

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
