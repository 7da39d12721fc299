"""Addresses of boards, and the sockets behind them: Unix, TCP on loopback, TLS beyond it."""

import contextlib
import ipaddress
import os
import socket
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from spikeport.errors import BackendError, UsageError

FORMS = "unix:PATH or tcp://HOST:PORT"
TLS_HANDSHAKE_S = 5.0
"""Time that the other side has for the handshake of TLS, before it is hung up on."""
CONNECT_S = 10.0


@dataclass(frozen=True)
class Certificates:
    """Files for TLS: an own certificate with its key, and who signed the other side's.

    Attributes
    ----------
    certificate, key : Path
        The own certificate and its private key, PEM.
    authority : Path
        The certificate of the authority that signed the other side's certificate, PEM.
    """

    certificate: Path
    key: Path
    authority: Path

    def context(self, server: bool) -> ssl.SSLContext:
        """Return the context of one side, which demands a certificate of the other.

        Raises
        ------
        UsageError
            If a file is missing or no certificate or key.
        """
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER if server else ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.verify_mode = ssl.CERT_REQUIRED
        try:
            context.load_cert_chain(self.certificate, self.key)
            context.load_verify_locations(self.authority)
        except (OSError, ssl.SSLError) as error:
            files = f"{self.certificate}, {self.key}, {self.authority}"
            raise UsageError(f"TLS: {error}; the files are {files}") from None
        return context


@dataclass(frozen=True)
class Address:
    """The address of a board.

    Attributes
    ----------
    text : str
        As it was written.
    host, port : str, int
        The TCP host and port.
    path : Path or None
        The Unix socket.
    """

    text: str
    host: str = ""
    port: int = 0
    path: Path | None = None

    @classmethod
    def parse(cls, text: str) -> "Address":
        """Return the address that a text names; UsageError if it names none."""
        if text.startswith("unix:") and len(text) > len("unix:"):
            return cls(text, path=Path(text.removeprefix("unix:")))
        host, _, port = text.removeprefix("tcp://").rpartition(":")
        if text.startswith("tcp://") and host and port.isdecimal() and int(port) < 2**16:
            # An IPv6 address stands in brackets.
            return cls(text, host.strip("[]"), int(port))
        raise UsageError(f"address {text!r}: write {FORMS}")

    @property
    def is_local(self) -> bool:
        """True of a Unix socket and of a loopback address, which no other machine reaches."""
        if self.path is not None or self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:  # a name
            return False

    def __str__(self) -> str:
        return self.text


def _refuse_tls_of_a_path(address: Address, certificates: Certificates | None) -> None:
    """Raise UsageError for certificates of a Unix socket, which has no host to be named in them."""
    if address.path is not None and certificates is not None:
        raise UsageError(
            f"{address}: TLS is for tcp://HOST:PORT; cure: leave --cert, --key and --ca out"
        )


def connect(address: Address, certificates: Certificates | None = None) -> socket.socket:
    """Return a socket that is connected with a board.

    Raises
    ------
    UsageError
        If the board is on another machine and there are no certificates, or it is a Unix socket
        and there are some.
    BackendError
        If nobody answers there, or either side's certificate is refused.
    """
    if not address.is_local and certificates is None:
        raise UsageError(
            f"{address}: a board on another machine is reached over TLS alone; give --cert, --key "
            "and --ca"
        )
    _refuse_tls_of_a_path(address, certificates)
    try:
        plain = _connected(address)
        if certificates is None:
            return plain
        with _closed_on_error(plain):
            return certificates.context(server=False).wrap_socket(
                plain, server_hostname=address.host
            )
    except OSError as error:  # ssl.SSLError is one
        reason = error.strerror or str(error)
        raise BackendError(
            f"board {address}: no connection ({reason}); is `spikeport board serve --listen "
            f"{address}` running?"
        ) from None


def _connected(address: Address) -> socket.socket:
    if address.path is None:
        made = socket.create_connection((address.host, address.port), CONNECT_S)
        made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # a step is one small frame
        return made
    made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with _closed_on_error(made):
        made.settimeout(CONNECT_S)
        made.connect(str(address.path))
    return made


@contextlib.contextmanager
def _closed_on_error(opened: socket.socket) -> Iterator[None]:
    try:
        yield
    except BaseException:
        opened.close()
        raise


@contextlib.contextmanager
def listening(
    address: Address, certificates: Certificates | None = None, allow_remote: bool = False
) -> Iterator[socket.socket]:
    """Yield a socket that listens; a Unix socket's file, for its owner only, is taken away after.

    Raises
    ------
    UsageError
        If the address is in use, cannot be listened on, is open to other machines without
        ``allow_remote`` or without certificates, or is a Unix socket's and there are some.
    """
    if not address.is_local and not (allow_remote and certificates is not None):
        raise UsageError(
            f"{address}: other machines could reach it; give --allow-remote with --cert, --key and "
            "--ca, or listen on 127.0.0.1"
        )
    _refuse_tls_of_a_path(address, certificates)
    try:
        listener = _bound(address)
    except OSError as error:
        raise UsageError(f"{address}: cannot be listened on ({error.strerror or error})") from None
    try:
        yield listener
    finally:
        listener.close()
        if address.path is not None:
            address.path.unlink(missing_ok=True)


def _bound(address: Address) -> socket.socket:
    if address.path is None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        return socket.create_server((address.host, address.port), family=family, backlog=4)
    _remove_dead(address.path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    with _closed_on_error(listener):
        before = os.umask(0o177)
        try:
            listener.bind(str(address.path))
        finally:
            os.umask(before)
        listener.listen(4)
    return listener


def _remove_dead(path: Path) -> None:
    """Remove the file of a socket that a killed server left; one that is in use stays."""
    if not path.is_socket():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)


def accepted(listener: socket.socket) -> socket.socket | None:
    """Return the next connection; None if it hung up."""
    try:
        connected, _ = listener.accept()
    except OSError:
        return None
    if connected.family != socket.AF_UNIX:
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connected


def secured(plain: socket.socket, context: ssl.SSLContext | None) -> socket.socket | None:
    """Return a connection, in TLS where there is a context; None if its certificate was refused."""
    if context is None:
        return plain
    try:
        with _closed_on_error(plain):
            plain.settimeout(TLS_HANDSHAKE_S)
            return context.wrap_socket(plain, server_side=True)
    except OSError:
        return None
