"""Frames over a pair of sockets: in time or not at all, and a peer that is gone is named."""

import socket

import pytest

from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.line import SocketLine
from spikeport.errors import BoardLostError


@pytest.fixture
def lines() -> tuple[SocketLine, SocketLine]:
    """Both ends of a line."""
    one, other = socket.socketpair()
    return SocketLine(one, "one"), SocketLine(other, "the other")


def test_frames_arrive_in_order(lines: tuple[SocketLine, SocketLine]) -> None:
    frames = [Frame(Kind.STEP, 1, number, b"x" * number) for number in range(5)]
    for frame in frames:
        lines[0].send(frame)
    assert [lines[1].receive(1.0) for _ in frames] == frames
    assert lines[1].receive(0.0) is None
    assert lines[1].bad == 0


def test_a_large_frame_arrives_whole(lines: tuple[SocketLine, SocketLine]) -> None:
    frame = Frame(Kind.IMAGE, body=bytes(150_000))
    lines[0].send(frame)
    assert lines[1].receive(5.0) == frame


def test_nothing_in_time_is_none(lines: tuple[SocketLine, SocketLine]) -> None:
    assert lines[0].receive(0.01) is None


def test_a_peer_that_is_gone_is_named(lines: tuple[SocketLine, SocketLine]) -> None:
    lines[1].close()
    with pytest.raises(BoardLostError, match=r"one: the link is gone \(it hung up\)"):
        lines[0].receive(1.0)
    lines[0].close()
    with pytest.raises(BoardLostError, match="one: the link is gone"):
        lines[0].receive(0.0)
