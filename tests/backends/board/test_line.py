"""Frames over a pair of sockets: their arrival in time, and the loss of a peer."""

import socket

import pytest

from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.line import SYSTEM_WAITS_S, SocketLine
from spikeport.errors import BoardLostError


@pytest.fixture
def lines() -> tuple[SocketLine, SocketLine]:
    """Return both ends of a line."""
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


@pytest.mark.parametrize("within_s", [0.0, 0.01, 1.2 * SYSTEM_WAITS_S])
def test_receiving_returns_none_if_no_frame_comes_in_time(
    lines: tuple[SocketLine, SocketLine], within_s: float
) -> None:
    assert lines[0].receive(within_s) is None


def test_a_peer_that_sends_on_without_a_frame_does_not_hold_its_reader(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("spikeport.backends.board.line.CHUNK", 16)
    one, other = socket.socketpair()
    frame = Frame(Kind.STEP, 1, 1)
    other.send(b"no frame" * 8 + frame.encode())
    line = SocketLine(one, "the other")
    received = [line.receive(0.0) for _ in range(10)]
    assert received[:4] == [None] * 4
    assert frame in received


def test_a_frame_that_comes_after_the_system_s_first_wait_is_received(
    lines: tuple[SocketLine, SocketLine], monkeypatch: pytest.MonkeyPatch
) -> None:
    take, frame = SocketLine._take, Frame(Kind.STEP, 1, 2)
    waits = []

    def taken(line: SocketLine) -> None:
        waits.append(take(line))
        if len(waits) == 1:
            lines[1].send(frame)

    monkeypatch.setattr(SocketLine, "_take", taken)
    assert lines[0].receive(100 * SYSTEM_WAITS_S) == frame
    assert len(waits) == 2


def test_a_peer_that_does_not_read_is_given_up(
    lines: tuple[SocketLine, SocketLine], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spikeport.backends.board.line.SEND_S", 0.01)
    with pytest.raises(BoardLostError, match=r"\(it does not read\)"):
        lines[0].send_bytes(bytes(1 << 22))


def test_a_peer_that_is_gone_is_named(lines: tuple[SocketLine, SocketLine]) -> None:
    lines[1].close()
    with pytest.raises(BoardLostError, match=r"one: the link is gone \(it hung up\)"):
        lines[0].receive(1.0)
    lines[0].close()
    with pytest.raises(BoardLostError, match="one: the link is gone"):
        lines[0].receive(0.0)
