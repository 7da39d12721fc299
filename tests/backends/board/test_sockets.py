"""Sockets of boards: their files, and protection from other machines."""

import contextlib
import socket
import stat
from pathlib import Path

import pytest

from spikeport.backends.board.address import Address
from spikeport.backends.board.sockets import accepted, connect, listening
from spikeport.errors import BackendError, UsageError
from tests.helpers.certificates import certificates


def test_listening_for_other_machines_needs_permission_and_certificates(
    tmp_path: Path,
) -> None:
    address = Address.parse("tcp://0.0.0.0:1")
    files = certificates(tmp_path, "board")
    for given, missing in (
        ((None, False), "give --allow-remote with --cert, --key and --ca, or"),
        ((None, True), "give --cert, --key and --ca, or"),
        ((files, False), "give --allow-remote, or"),
    ):
        with pytest.raises(UsageError, match=missing), listening(address, *given):
            pass


def test_connecting_to_another_machine_needs_certificates() -> None:
    with pytest.raises(
        UsageError, match="a board on another machine needs TLS; give --cert, --key and --ca"
    ):
        connect(Address.parse("tcp://192.0.2.1:80"))


def test_certificates_and_permission_are_refused_for_a_path(tmp_path: Path) -> None:
    address = Address.parse(f"unix:{tmp_path / 'board'}")
    files = certificates(tmp_path, "board")
    with pytest.raises(UsageError, match="TLS is for tcp://HOST:PORT; cure: leave --cert"):
        connect(address, files)
    with pytest.raises(UsageError, match="TLS is for tcp"), listening(address, files):
        pass
    with (
        pytest.raises(UsageError, match="leave --allow-remote out"),
        listening(address, None, True),
    ):
        pass


def test_a_socket_is_its_owners_alone_and_is_removed_after_listening(tmp_path: Path) -> None:
    address = Address.parse(f"unix:{tmp_path / 'board'}")
    with listening(address):
        assert stat.S_IMODE((tmp_path / "board").stat().st_mode) == 0o600
        with pytest.raises(UsageError, match="the board cannot listen there"), listening(address):
            pass
        connect(address).close()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(BackendError, match=r"is `spikeport board serve --listen unix:.*` running"):
        connect(address)


def test_the_socket_of_a_killed_server_is_replaced(tmp_path: Path) -> None:
    dead = socket.socket(socket.AF_UNIX)
    dead.bind(str(tmp_path / "board"))
    dead.close()
    with listening(Address.parse(f"unix:{tmp_path / 'board'}")):
        pass


def test_the_socket_of_another_server_stays(tmp_path: Path) -> None:
    address = Address.parse(f"unix:{tmp_path / 'board'}")
    with listening(address):
        (tmp_path / "board").unlink()
        with socket.socket(socket.AF_UNIX) as other:
            other.bind(str(tmp_path / "board"))
    assert (tmp_path / "board").is_socket()


def test_a_file_that_is_not_a_socket_stays(tmp_path: Path) -> None:
    address = Address.parse(f"unix:{tmp_path / 'board'}")
    (tmp_path / "board").write_text("precious")  # written after the address was read
    with pytest.raises(UsageError, match="the board cannot listen there"), listening(address):
        pass
    assert (tmp_path / "board").read_text() == "precious"


def test_keepalive_detects_a_host_without_power_within_30_s() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as listener,
        socket.create_connection(listener.getsockname()),
    ):
        connected = accepted(listener)
        assert connected is not None
        with connected:
            assert connected.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
            idle_s, every_s, n = (connected.getsockopt(socket.IPPROTO_TCP, o) for o in options)
            assert idle_s + n * every_s <= 30


def test_a_server_that_accepts_nobody_is_not_waited_for(tmp_path: Path) -> None:
    """Its queue is full: an attempt to connect would block until it accepts."""
    path = tmp_path / "board"
    with socket.socket(socket.AF_UNIX) as busy, contextlib.ExitStack() as waiting:
        busy.bind(str(path))
        busy.listen(0)
        with contextlib.suppress(BlockingIOError):
            while True:
                host = waiting.enter_context(socket.socket(socket.AF_UNIX))
                host.setblocking(False)
                host.connect(str(path))
        with pytest.raises(UsageError), listening(Address.parse(f"unix:{path}")):
            pass
    assert path.is_socket()
