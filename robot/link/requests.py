"""Requests of a robot's services and their answers as bytes.

Both have a head of fixed length, a text, and bytes that no service here uses. Texts are in XCDR1:
from the next multiple of 4 on, a length, then the text and a zero byte, which the length counts.
"""

import struct
from typing import NamedTuple

from spikeport.robot.link.wire import WORD, MessageError

_REQUEST, _RESPONSE = struct.Struct("<qqqi?3x"), struct.Struct("<qqi")
_LENGTH = struct.Struct("<I")
LONGEST_TEXT = 65_536
"""The most bytes of a text; the motion switcher's texts have about 50."""


class Request(NamedTuple):
    """A request: a number that its answer repeats, the function of the service, and JSON."""

    number: int
    function: int
    parameter: str


class Response(NamedTuple):
    """An answer to a request: its number and function, 0 or the code of an error, and JSON."""

    number: int
    function: int
    code: int
    data: str


def encode_request(request: Request) -> bytes:
    """Return the message of a request, without a lease, of priority 0, to be answered."""
    head = _REQUEST.pack(request.number, request.function, 0, 0, False)
    return head + _with_text(request.parameter)


def encode_response(response: Response) -> bytes:
    """Return the message of an answer."""
    head = _RESPONSE.pack(response.number, response.function, response.code)
    return head + _with_text(response.data)


def decode_request(message: bytes) -> Request:
    """Return the request in a message; raises MessageError if it is invalid."""
    number, function, *_ = _head(_REQUEST, "Request_", message)
    return Request(number, function, _text(_REQUEST, "Request_", message))


def decode_response(message: bytes) -> Response:
    """Return the answer in a message; raises MessageError if it is invalid."""
    number, function, code = _head(_RESPONSE, "Response_", message)
    return Response(number, function, code, _text(_RESPONSE, "Response_", message))


def _with_text(text: str) -> bytes:
    """Return the encoding of a text after a head, and of no bytes after the text."""
    data = text.encode() + b"\0"
    # Zeros to the next multiple of 4, then the number of bytes, 0.
    return _LENGTH.pack(len(data)) + data + bytes(-len(data) % WORD) + _LENGTH.pack(0)


def _head(head: struct.Struct, name: str, message: bytes) -> tuple[int, ...]:
    if len(message) < head.size + _LENGTH.size:
        raise MessageError(f"{name}: {len(message)} bytes are too few")
    return head.unpack_from(message)


def _text(head: struct.Struct, name: str, message: bytes) -> str:
    """Return the text after a head; invalid UTF-8 is replaced, and later bytes are not read."""
    (length,) = _LENGTH.unpack_from(message, head.size)
    begin = head.size + _LENGTH.size
    most = min(LONGEST_TEXT, len(message) - begin)
    if not 1 <= length <= most:
        raise MessageError(f"{name}: a text of {length} bytes, from 1 to {most} are allowed")
    return message[begin : begin + length - 1].decode(errors="replace")
