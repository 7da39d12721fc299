"""A line: frames over a socket, within a time; and the clock that times are measured by."""

import socket
import ssl
import time
from typing import Protocol

from spikeport.backends.board.frame import Frame, Splitter
from spikeport.errors import BoardLostError

CHUNK = 1 << 18
SEND_S = 5.0
"""Time in which the other side must take a frame; buffers of the system hold hundreds of them."""


class Clock(Protocol):
    """A clock in s, of which only differences mean something."""

    def now(self) -> float:
        """Return the time, in s."""

    def sleep_until(self, time_s: float) -> None:
        """Wait until a time; at once if it has passed."""


class SystemClock:
    """The clock of this machine."""

    def now(self) -> float:
        """Return the time, in s."""
        return time.perf_counter()

    def sleep_until(self, time_s: float) -> None:
        """Wait until a time; at once if it has passed."""
        left = time_s - time.perf_counter()
        if left > 0:
            time.sleep(left)


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
        """How often bytes came that were no frame."""

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
        self._socket = connected
        self._splitter = Splitter()
        self._name = name

    def fileno(self) -> int:
        """Return the number by which selectors know the socket."""
        return self._socket.fileno()

    @property
    def bad(self) -> int:
        """How often bytes came that were no frame."""
        return self._splitter.bad

    def send(self, frame: Frame) -> None:
        """Send a frame; BoardLostError if the other side hung up."""
        self.send_bytes(frame.encode())

    def send_bytes(self, data: bytes) -> None:
        """Send bytes as they are."""
        try:
            self._socket.settimeout(SEND_S)
            self._socket.sendall(data)
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from None

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame, or None if none came in time; see `Line.receive`."""
        frame = self._splitter.next()
        end = time.perf_counter() + within_s
        left = within_s
        while frame is None and left >= 0:
            if not self._take(left):
                return None
            frame = self._splitter.next()
            left = end - time.perf_counter()
        return frame

    def _take(self, within_s: float) -> bool:
        """Take bytes that have arrived, or arrive in time; True if there were any."""
        try:
            self._socket.settimeout(within_s)
            data = self._socket.recv(CHUNK)
        except (TimeoutError, BlockingIOError, ssl.SSLWantReadError):
            return False
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from None
        if not data:
            raise self._lost("it hung up")
        self._splitter.feed(data)
        return True

    def _lost(self, reason: str) -> BoardLostError:
        return BoardLostError(f"{self._name}: the link is gone ({reason})")

    def close(self) -> None:
        """Hang up."""
        self._socket.close()
