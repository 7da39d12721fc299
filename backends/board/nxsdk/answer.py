"""The complete answer of a board's host to a step.

nengo-loihi takes a -1 at the end of an answer as a sign that the chip was shut down. But a valid
answer may end in -1: the rest of its last packet has whatever was in the memory of the chip's snip,
and the last voltage may be -1.
"""

import socket
from typing import Any

import numpy as np

from spikeport.errors import BackendError

END = -1
"""The value that fills the buffer of the host's snip, 2,048 values, when it shuts down."""
WRITE = 1024
"""Values that the host's snip writes at once; it shuts down between writes."""


def recv_bytes(snip: Any, bytes_expected: int) -> np.ndarray:
    """Return the values of an answer; this replaces nengo-loihi's ``HostSnip.recv_bytes``.

    A board that shut down sends -1 as the first value (which is otherwise the time step, and never
    negative), or sends a last write of nothing but -1.

    Parameters
    ----------
    snip : HostSnip
        nengo-loihi's snip; a read of its ``socket`` waits ``recv_retries`` x ``recv_timeout`` s.
    bytes_expected : int
        Size of the answer, in packets of 256 bytes.

    Returns
    -------
    values : (n,) int32 array
        The time step and the outputs of each chip, filled up to whole packets.

    Raises
    ------
    BackendError
        If the board shut down, hung up, or does not answer in time.
    """
    data = bytearray(bytes_expected)
    _fill(data, snip.socket, snip.recv_retries * snip.recv_timeout)
    values = np.frombuffer(data, np.int32)
    last_write = values[(len(values) - 1) // WRITE * WRITE :]
    if values[0] == END or (last_write == END).all():
        raise BackendError("the board shut down: its snips sent -1 for the answer to a step")
    return values


def _fill(data: bytearray, connected: socket.socket, within_s: float) -> None:
    """Read as many bytes as there is room for, each read within a time."""
    left = memoryview(data)
    while left:
        try:
            connected.settimeout(within_s)
            n = connected.recv_into(left)
        except TimeoutError:
            raise _cut("does not answer", data, left) from None
        except OSError as error:
            raise _cut(f"is gone ({error.strerror or error})", data, left) from None
        if n == 0:
            raise _cut("hung up", data, left)
        left = left[n:]


def _cut(reason: str, data: bytearray, left: memoryview) -> BackendError:
    got = len(data) - len(left)
    return BackendError(f"the board's host {reason}: {got:,} of {len(data):,} bytes of a step came")
