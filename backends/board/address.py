"""Addresses of boards, and the certificates for those on other machines."""

import ipaddress
import os
import ssl
from dataclasses import dataclass
from pathlib import Path

from spikeport.errors import UsageError, reason_of

FORMS = "unix:PATH or tcp://HOST:PORT"
MOST_PORT = 2**16 - 1
MOST_PATH = 107
"""Bytes in the longest path of a Unix socket on Linux."""


@dataclass(frozen=True)
class Certificates:
    """Files for TLS: a certificate with its key, and the authority of the other side's.

    Attributes
    ----------
    certificate, key : Path
        The certificate of this side and its private key, PEM.
    authority : Path
        The certificate of the authority that signed the other side's certificate, PEM.
    """

    certificate: Path
    key: Path
    authority: Path

    def context(self, server: bool) -> ssl.SSLContext:
        """Return the context of one side, which demands a certificate from the other.

        Raises
        ------
        UsageError
            If a file is missing, or is not a certificate or key; the message names it.
        """
        for path in (self.certificate, self.key, self.authority):
            if not os.access(path, os.R_OK):  # ssl does not say which file it cannot read
                raise UsageError(f"TLS: {path}: no such file, or it cannot be read")
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER if server else ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.verify_mode = ssl.CERT_REQUIRED
        try:
            files = f"{self.certificate}, {self.key}: no certificate in PEM with its private key"
            context.load_cert_chain(self.certificate, self.key)
            files = f"{self.authority}: no certificate in PEM"
            context.load_verify_locations(self.authority)
        except OSError as error:  # ssl.SSLError is an OSError
            raise UsageError(f"TLS: {files} ({reason_of(error)})") from None
        return context


@dataclass(frozen=True)
class Address:
    """The address of a board.

    Attributes
    ----------
    text : str
        The address, as it was written.
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
    def parse(cls, text: str, forms: str = FORMS) -> "Address":
        """Return the address that a text names; UsageError, which lists forms, if it names none."""
        if text.startswith("unix:") and len(text) > len("unix:"):
            return cls(text, path=_socket_path(text.removeprefix("unix:")))
        host, _, port = text.removeprefix("tcp://").rpartition(":")
        if text.startswith("tcp://") and host and port.isdecimal():
            # An IPv6 address is in brackets.
            return cls(text, _host(text, host.strip("[]")), _port(text, port))
        raise UsageError(f"address {text!r}: write {forms}")

    @property
    def is_local(self) -> bool:
        """True for a Unix socket and for a loopback address: no other machine reaches these."""
        if self.path is not None or self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:  # a name
            return False

    def __str__(self) -> str:
        return self.text


def _host(text: str, host: str) -> str:
    """Return the host of an address; UsageError if it is not a valid name."""
    try:
        host.encode("idna")  # as sockets do
    except UnicodeError:
        raise UsageError(
            f"address {text!r}: {host!r} is not a valid host name: each part between dots must "
            "have 1 to 63 characters; choose another"
        ) from None
    return host


def _port(text: str, digits: str) -> int:
    """Return the port of an address; UsageError if it is above TCP's largest port."""
    digits = digits.lstrip("0") or "0"
    # Count the digits first: Python refuses to make an integer of thousands of digits.
    if len(digits) > len(str(MOST_PORT)) or int(digits) > MOST_PORT:
        raise UsageError(
            f"address {text!r}: port {digits}, limit {MOST_PORT:,}; choose a smaller one"
        )
    return int(digits)


def _socket_path(text: str) -> Path:
    """Return the path of a Unix socket; UsageError if it is too long, or not a socket's."""
    if (size := len(os.fsencode(text))) > MOST_PATH:
        raise UsageError(
            f"unix:{text}: the path has {size} bytes, limit {MOST_PATH}; choose a shorter one"
        )
    path = Path(text)
    # `Path.exists` raises for a folder that cannot be searched.
    if os.path.exists(path) and not path.is_socket():
        kind = "folder" if path.is_dir() else "file"
        raise UsageError(f"unix:{text}: there is a {kind}, not a socket; choose another path")
    return path
