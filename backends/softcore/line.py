"""Lines to a board with soft cores: a serial one of this computer, and one in simulation."""

import ctypes
import os
import select
import termios
import time
from pathlib import Path
from typing import Protocol

import numpy as np

from spikeport.arrays import pointer
from spikeport.atomic import lock
from spikeport.backends.softcore.verilated import LOG_PATIENCE, BoardBuild, library
from spikeport.errors import BackendError, UsageError

BAUD = 3_000_000
"""The fastest rate of the FT231X on a ULX3S; boards are built for it."""
PATIENCE_S = 2.0
"""Time after which an answer is not waited for any more."""
QUIET_S = 0.3
"""Silence after which a board has dropped a command that was not whole, and sends nothing more."""


class ByteLine(Protocol):
    """A line that carries bytes to a board and answers back."""

    def exchange(self, sent: bytes, n: int) -> bytes:
        """Send bytes, and return the n bytes of the answer.

        Raises
        ------
        BackendError
            If the answer does not come.
        """

    def restart(self, sent: bytes) -> None:
        """Wait until the line is quiet, send bytes, and drop the answer.

        Raises
        ------
        BackendError
            If the line does not become quiet.
        """

    def close(self) -> None:
        """Free the line."""


class SerialLine:
    """A serial device of this computer, such as ``/dev/ttyUSB0``.

    Parameters
    ----------
    path : Path
        The device.
    baud : int
        Bits per second; without effect on a FIFO to USB.

    Raises
    ------
    UsageError
        If the device cannot be opened, is in use, is not a serial line, or does not support the
        speed.
    """

    def __init__(self, path: Path, baud: int = BAUD) -> None:
        speed = getattr(termios, f"B{baud}", None)
        if speed is None:
            raise UsageError(f"baud {baud:,}: this computer's serial lines do not have it")
        try:
            # O_NONBLOCK: a line without carrier detect would never open. O_NOCTTY: it must not
            # become the terminal that Ctrl-C comes from.
            self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise UsageError(f"device '{path}' cannot be opened: {error.strerror}") from None
        if not lock(self._file):
            os.close(self._file)
            raise UsageError(f"device '{path}' is in use by another process; wait until it ends")
        try:
            _set_raw(self._file, speed)
        except termios.error as error:
            os.close(self._file)
            raise UsageError(f"device '{path}' is no serial line: {error.args[-1]}") from None

    def restart(self, sent: bytes) -> None:
        """See `ByteLine.restart`."""
        self._drain()
        self.exchange(sent, 0)
        self._drain()

    def _drain(self) -> None:
        """Drop the bytes that come, until none has come for `QUIET_S`."""
        end_s = time.monotonic() + PATIENCE_S
        while self._ready(select.POLLIN, QUIET_S):
            if time.monotonic() > end_s:
                raise BackendError(
                    "the device sends without being asked; cure: name the serial line of the board"
                )
            self._read(1 << 16)

    def exchange(self, sent: bytes, n: int) -> bytes:
        """See `ByteLine.exchange`."""
        rest = memoryview(sent)
        while rest:
            if not self._ready(select.POLLOUT, PATIENCE_S):
                raise BackendError(f"the board takes no bytes for {PATIENCE_S:g} s")
            rest = rest[self._write(rest[: 1 << 12]) :]
        answer = b""
        while len(answer) < n:
            if not self._ready(select.POLLIN, PATIENCE_S):
                raise BackendError(
                    f"the board answered {len(answer)} of {n} bytes within {PATIENCE_S:g} s; cure: "
                    "load the bitstream that was made for this image, and give its --baud"
                )
            answer += self._read(n - len(answer))
        return answer

    def _write(self, octets: memoryview) -> int:
        try:
            return os.write(self._file, octets)
        except OSError as error:
            raise BackendError(f"the line to the board: {error.strerror}") from None

    def _read(self, most: int) -> bytes:
        try:
            octets = os.read(self._file, most)
        except OSError as error:
            raise BackendError(f"the line to the board: {error.strerror}") from None
        if not octets:
            raise BackendError("the line to the board was unplugged")
        return octets

    def _ready(self, event: int, seconds: float) -> bool:
        waiting = select.poll()
        waiting.register(self._file, event)
        return bool(waiting.poll(1000 * seconds))

    def close(self) -> None:
        """See `ByteLine.close`."""
        os.close(self._file)


def _set_raw(file: int, speed: int) -> None:
    """Let all bytes through as they are, whatever settings the line's last user has left."""
    input_flags = output_flags = local = 0
    control = termios.CS8 | termios.CREAD | termios.CLOCAL
    characters = termios.tcgetattr(file)[6]
    characters[termios.VMIN], characters[termios.VTIME] = 1, 0
    settings = [input_flags, output_flags, control, local, speed, speed, characters]
    termios.tcsetattr(file, termios.TCSANOW, settings)


class VerilatedLine:
    """A board in Verilator, at the end of a line that is simulated bit by bit.

    Parameters
    ----------
    build : BoardBuild
        The board.
    clock_hz : float
        Frequency of its clock, which the FIFO's times in ns are measured against.
    baud_error : float
        Share by which the host's bits are longer than the board's.

    Attributes
    ----------
    cycles : int
        Cycles of the last exchange, from the first byte to the last.
    """

    most_cycles = 1 << 26
    quiet_cycles = 1 << (LOG_PATIENCE + 1)

    def __init__(self, build: BoardBuild, clock_hz: float = 45e6, baud_error: float = 0.0) -> None:
        self._library = library(build)
        self._library.board_open.restype = ctypes.c_void_p
        self._library.board_exchange.restype = ctypes.c_int64
        self._library.board_restart.restype = ctypes.c_int64
        self._bit_cycles = build.baud_cycles
        bit = ctypes.c_double(build.baud_cycles * (1 + baud_error))
        opened = self._library.board_open(bit, ctypes.c_double(1e9 / clock_hz))
        self._board: ctypes.c_void_p | None = ctypes.c_void_p(opened)
        self.cycles = 0

    def restart(self, sent: bytes) -> None:
        """See `ByteLine.restart`."""
        self._refuse(
            self._library.board_restart(
                self._board,
                sent,
                len(sent),
                ctypes.c_int64(self.quiet_cycles),
                ctypes.c_int64(self.most_cycles),
            ),
            self.most_cycles,
        )

    def exchange(self, sent: bytes, n: int) -> bytes:
        """See `ByteLine.exchange`."""
        answer = np.zeros(n, dtype=np.uint8)
        # A byte takes ten bits of the line, or as many cycles of the FIFO.
        most = self.most_cycles + 10 * max(self._bit_cycles, 1) * (len(sent) + n)
        self.cycles = self._library.board_exchange(
            self._board,
            sent,
            len(sent),
            pointer(answer),
            n,
            ctypes.c_int64(most),
        )
        self._refuse(self.cycles, most)
        return answer.tobytes()

    def _refuse(self, returned: int, most: int) -> None:
        """Raise an error if a function of the board returned one."""
        if returned == -2:
            raise BackendError("the board broke a rule of its FIFO's data sheet")
        if returned < 0:
            raise BackendError(f"the board did not answer in {most:,} cycles")

    def close(self) -> None:
        """See `ByteLine.close`."""
        if self._board is not None:
            self._library.board_close(self._board)
            self._board = None
