"""Addresses of boards and files of TLS: refusals that name the cure."""

from pathlib import Path

import pytest

from spikeport.backends.board.address import Address
from spikeport.errors import UsageError
from tests.helpers.certificates import certificates


@pytest.mark.parametrize(
    "text",
    ["", "unix:", "tcp://", "tcp://127.0.0.1", "tcp://:80", "tcp://a:b", "x"],
)
def test_texts_that_are_not_addresses_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="write unix:PATH or tcp://HOST:PORT"):
        Address.parse(text)


def test_a_port_that_is_too_large_is_named() -> None:
    assert Address.parse("tcp://a:065535").port == 65535
    for port in ("65536", "9" * 5000):
        with pytest.raises(UsageError, match=f"port {port}, limit 65,535; choose a smaller one"):
            Address.parse(f"tcp://a:{port}")


@pytest.mark.parametrize("host", ["a..b", "a" * 70, "\udcff"])
def test_a_host_that_is_not_a_valid_name_is_refused(host: str) -> None:
    with pytest.raises(
        UsageError, match="is not a valid host name: each part between dots must have 1 to"
    ):
        Address.parse(f"tcp://{host}:80")


def test_a_path_that_cannot_be_a_socket_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious")
    for path, kind in ((tmp_path, "folder"), (tmp_path / "file", "file")):
        with pytest.raises(UsageError, match=f"there is a {kind}, not a socket; choose another"):
            Address.parse(f"unix:{path}")
    Address.parse(f"unix:{'x' * 107}")
    with pytest.raises(UsageError, match="the path has 108 bytes, limit 107; choose a shorter"):
        Address.parse(f"unix:{'x' * 108}")


@pytest.mark.parametrize(
    ("text", "is_local"),
    [
        ("unix:/nowhere/x", True),
        ("tcp://127.0.0.1:80", True),
        ("tcp://[::1]:80", True),
        ("tcp://localhost:80", True),
        ("tcp://0.0.0.0:80", False),
        ("tcp://192.168.1.5:80", False),
        ("tcp://board.example:80", False),
    ],
)
def test_an_address_is_local_if_only_this_machine_reaches_it(text: str, is_local: bool) -> None:
    assert Address.parse(text).is_local is is_local


def test_a_wrong_file_of_tls_is_named(tmp_path: Path) -> None:
    files = certificates(tmp_path, "board")
    for path, role in ((files.authority, ""), (files.key, " with its private key")):
        path.write_text("nothing")
        with pytest.raises(UsageError, match=rf"{path}: no certificate in PEM{role} \(\w"):
            files.context(server=True)
    files.key.unlink()
    with pytest.raises(UsageError, match=f"TLS: {files.key}: no such file"):
        files.context(server=True)
