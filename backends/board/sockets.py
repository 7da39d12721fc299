"""Sockets at a board's address: Unix, TCP on loopback, TLS beyond it."""

import contextlib
import os
import socket
import ssl
from collections.abc import Callable, Iterator
from pathlib import Path

from spikeport.backends.board.address import Address, Certificates
from spikeport.errors import BackendError, UsageError, reason_of

TLS_HANDSHAKE_S = 5.0
"""Time that the other side has for the TLS handshake, before this side hangs up."""
CONNECT_S = 10.0


def client_context(
    address: Address, certificates: Certificates | None = None
) -> ssl.SSLContext | None:
    """Return the context of a host's TLS; None without certificates.

    Raises
    ------
    UsageError
        If the board is on another machine and there are no certificates, if the address is a Unix
        socket's and there are certificates, or if a file is wrong.
    """
    if not address.is_local and certificates is None:
        raise UsageError(
            f"{address}: a board on another machine needs TLS; give --cert, --key and --ca"
        )
    return _context(address, certificates, server=False)


def _context(
    address: Address, certificates: Certificates | None, server: bool
) -> ssl.SSLContext | None:
    # A Unix socket has no host that a certificate could name.
    if address.path is not None and certificates is not None:
        raise UsageError(
            f"{address}: TLS is for tcp://HOST:PORT; cure: leave --cert, --key and --ca out"
        )
    return None if certificates is None else certificates.context(server)


def connect(address: Address, certificates: Certificates | None = None) -> socket.socket:
    """Return a socket that is connected with a board.

    Raises
    ------
    UsageError
        See `client_context`.
    BackendError
        If no board answers there, if it has no TLS, or if its certificate is refused.
    """
    context = client_context(address, certificates)
    try:
        plain = _connected(address)
    except OSError as error:
        raise BackendError(
            f"board {address}: no connection ({reason_of(error)}); is `spikeport board serve "
            f"--listen {address}` running?"
        ) from None
    if context is None or certificates is None:
        return plain
    try:
        with _closed_on_error(plain):
            return context.wrap_socket(plain, server_hostname=address.host)
    except ssl.SSLCertVerificationError as error:
        raise BackendError(
            f"board {address}: its certificate is refused ({error.verify_message}); it must be "
            f"signed by --ca {certificates.authority}, name {address.host} and not have expired"
        ) from None
    except OSError as error:  # ssl.SSLError is an OSError
        raise BackendError(
            f"board {address}: the TLS handshake failed ({reason_of(error)}); does it serve with "
            "--cert, --key and --ca?"
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
) -> Iterator[tuple[socket.socket, ssl.SSLContext | None]]:
    """Yield a socket that listens, and the context of its TLS, None without certificates.

    The file of a Unix socket is for its owner only, and is removed at the end.

    Raises
    ------
    UsageError
        If the board cannot listen at the address, as when it is in use, if other machines can reach
        it and ``allow_remote`` or certificates are missing, if it is a Unix socket's and either is
        there, or if a file is wrong.
    """
    given = {"--allow-remote": allow_remote, "--cert, --key and --ca": certificates is not None}
    missing = " with ".join(option for option, is_given in given.items() if not is_given)
    if missing and not address.is_local:
        raise UsageError(
            f"{address}: other machines could reach it; give {missing}, or listen on 127.0.0.1"
        )
    if allow_remote and address.path is not None:
        raise UsageError(
            f"{address}: no other machine reaches a Unix socket; leave --allow-remote out, or "
            "listen on tcp://HOST:PORT"
        )
    context = _context(address, certificates, server=True)
    try:
        listener = _bound(address)
    except OSError as error:
        raise UsageError(
            f"{address}: the board cannot listen there ({reason_of(error)}); choose another"
        ) from None
    with listener, _taken_away(address.path):
        yield listener, context


@contextlib.contextmanager
def _taken_away(path: Path | None) -> Iterator[None]:
    """Remove the file of a Unix socket at the end, unless it is another server's by then."""
    if path is None:
        yield
        return
    ours = path.stat()
    try:
        yield
    finally:
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(ours, path.stat()):
                path.unlink()


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
    """Remove the file of a socket that a killed server left; a socket that is in use stays."""
    if not path.is_socket():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        # A server that builds a chip accepts nobody: its queue may be full.
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except BlockingIOError:
            return
        except ConnectionRefusedError:
            path.unlink(missing_ok=True)


def bound_text(address: Address, listener: socket.socket) -> str:
    """Return an address as text, with the port that the system chose in place of 0."""
    if address.path is not None:
        return str(address)
    return f"{address.text.rpartition(':')[0]}:{listener.getsockname()[1]}"


def accepted(listener: socket.socket) -> socket.socket | None:
    """Return the next connection; None if the host hung up."""
    try:
        connected, _ = listener.accept()
    except OSError:
        return None
    if connected.family != socket.AF_UNIX:
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _keep_alive(connected)
    return connected


def _keep_alive(connected: socket.socket) -> None:
    """Let the system find out within half a minute if a host lost its power or its network."""
    connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (
        (socket.TCP_KEEPIDLE, 10),
        (socket.TCP_KEEPINTVL, 5),
        (socket.TCP_KEEPCNT, 3),
    ):
        connected.setsockopt(socket.IPPROTO_TCP, option, value)


def secured(
    plain: socket.socket, context: ssl.SSLContext | None, say: Callable[[str], None]
) -> socket.socket | None:
    """Return a connection, with TLS if there is a context; say why and return None if TLS fails."""
    if context is None:
        return plain
    try:
        with _closed_on_error(plain):
            plain.settimeout(TLS_HANDSHAKE_S)
            return context.wrap_socket(plain, server_side=True)
    except OSError as error:
        say(f"board: refused a host: the TLS handshake failed ({reason_of(error)})")
        return None
