"""Answers of a board, even with values of -1, told apart from its shutdown."""

import socket
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import spikeport.compile.ground  # noqa: F401 (imports nengo-loihi in silence)

# isort: split
from nengo_loihi.hardware.interface import HostSnip

from spikeport.backends.board.nxsdk.answer import WRITE, recv_bytes
from spikeport.errors import BackendError

PACKET = 64
SHUTDOWN = [-1] * 2 * WRITE


def snip(sent: list[int], hangs_up: bool = False) -> Any:
    """Return the part of a host's snip that reads answers, with values sent to it."""
    ours, theirs = socket.socketpair()
    theirs.sendall(np.array(sent, dtype=np.int32).tobytes())
    if hangs_up:
        theirs.close()
    return SimpleNamespace(
        socket=ours, theirs=theirs, recv_retries=2, recv_timeout=0.01, recv_size=4096
    )


def answer(n: int = PACKET, last: int = -1) -> list[int]:
    """Return the n values of an answer, the first of which is the number of the step."""
    return [7, *range(100, 100 + n - 2), last]


@pytest.mark.parametrize("n", [PACKET, 2 * PACKET, WRITE, WRITE + PACKET])
def test_a_last_value_of_minus_one_is_a_value(n: int) -> None:
    assert recv_bytes(snip(answer(n)), 4 * n).tolist() == answer(n)
    with pytest.raises(RuntimeError, match="Received shutdown signal"):  # as in nengo-loihi
        HostSnip.recv_bytes(snip(answer(n)), 4 * n)


def test_a_packet_of_minus_ones_after_another_packet_is_read_as_values() -> None:
    sent = [*answer(), *[-1] * PACKET]
    assert recv_bytes(snip(sent), 8 * PACKET).tolist() == sent


def test_reading_an_answer_leaves_the_bytes_after_it() -> None:
    host = snip([*answer(), *SHUTDOWN])
    assert recv_bytes(host, 4 * PACKET).tolist() == answer()
    with pytest.raises(BackendError, match="the board shut down"):
        recv_bytes(host, 4 * PACKET)


@pytest.mark.parametrize(
    ("before", "n"),
    [
        ([], PACKET),
        ([], WRITE + PACKET),
        (answer(WRITE), WRITE + PACKET),  # a second chip's, whose shutdown follows the first's
        (answer(WRITE), 2 * WRITE),
    ],
)
def test_a_shutdown_is_recognised_wherever_it_comes(before: list[int], n: int) -> None:
    with pytest.raises(BackendError, match="the board shut down"):
        recv_bytes(snip([*before, *SHUTDOWN]), 4 * n)


def test_a_first_value_of_minus_one_is_a_shutdown() -> None:
    with pytest.raises(BackendError, match="the board shut down"):
        recv_bytes(snip([-1, *[0] * (PACKET - 1)]), 4 * PACKET)


@pytest.mark.parametrize(
    ("hangs_up", "reason"), [(True, "hung up: 40 of 256 bytes"), (False, "does not answer: 40 of")]
)
def test_a_truncated_answer_is_refused(hangs_up: bool, reason: str) -> None:
    with pytest.raises(BackendError, match=f"the board's host {reason}"):
        recv_bytes(snip(answer()[:10], hangs_up), 4 * PACKET)


def test_a_socket_that_failed_is_reported_as_gone() -> None:
    host = snip([])
    host.socket.close()
    with pytest.raises(BackendError, match="is gone"):
        recv_bytes(host, 4 * PACKET)
