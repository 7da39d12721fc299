"""Requests and answers as bytes, against cyclonedds' own serialisation."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spikeport.robot.link.messages import REQUEST, RESPONSE
from spikeport.robot.link.requests import (
    LONGEST_TEXT,
    Request,
    Response,
    decode_request,
    decode_response,
    encode_request,
    encode_response,
)
from spikeport.robot.link.wire import MessageError

XCDR1 = bytes((0, 1, 0, 0))
WORDS = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), max_size=99)
NUMBERS = st.integers(-(2**63), 2**63 - 1)


@given(NUMBERS, NUMBERS, st.integers(-(2**31), 2**31 - 1), WORDS)
def test_messages_are_encoded_as_cyclonedds_encodes_them(
    number: int, function: int, code: int, text: str
) -> None:
    pytest.importorskip("cyclonedds", reason="cyclonedds is absent: pip install 'spikeport[link]'")
    from spikeport.robot.link.idl import idl_type

    request, response = idl_type(REQUEST)(), idl_type(RESPONSE)()
    for sample in (request, response):
        sample.header.identity.id, sample.header.identity.api_id = number, function
    request.parameter = response.data = text
    response.header.status.code = code
    assert XCDR1 + encode_request(Request(number, function, text)) == request.serialize()
    assert XCDR1 + encode_response(Response(number, function, code, text)) == response.serialize()


@given(NUMBERS, WORDS)
def test_messages_are_read_as_they_were_written(number: int, text: str) -> None:
    request, response = Request(number, 1001, text), Response(number, 1001, 7002, text)
    assert decode_request(encode_request(request)) == request
    assert decode_response(encode_response(response)) == response


def test_bytes_after_the_text_are_ignored() -> None:
    sent = Response(1, 1001, 0, '{"name":""}')
    assert decode_response(encode_response(sent)[:-4] + struct.pack("<I3s", 3, b"abc")) == sent


@pytest.mark.parametrize(
    ("length", "limit"), [(0, 4), (5, 4), (2**32 - 1, 4), (LONGEST_TEXT + 1, LONGEST_TEXT)]
)
def test_a_text_longer_than_its_message_is_refused(length: int, limit: int) -> None:
    rest = bytes(max(4, min(length, LONGEST_TEXT + 4)))
    message = bytes(20) + struct.pack("<I", length) + (rest if limit > 4 else bytes(4))
    with pytest.raises(
        MessageError, match=f"Response_: a text of {length} bytes, from 1 to {limit}"
    ):
        decode_response(message)


@pytest.mark.parametrize("size", [0, 8, 35])
def test_a_message_without_a_head_is_refused(size: int) -> None:
    with pytest.raises(MessageError, match=f"Request_: {size} bytes are too few"):
        decode_request(bytes(size))
