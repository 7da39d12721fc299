"""Greetings of host and board, and refusals of other bodies by field."""

import pytest

from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.messages import BodyError
from spikeport.constants import LARGEST_SEED


def test_greetings_are_unpacked_as_they_were_packed() -> None:
    hello, welcome = Hello("ab", 3), Welcome("ab", "native", 5300.5)
    assert Hello.unpack(hello.pack()) == hello
    assert Welcome.unpack(welcome.pack()) == welcome


@pytest.mark.parametrize(
    ("body", "key"),
    [
        (b"", ""),
        (b"[]", ""),
        (b'{"digest": "ab"}', "seed"),
        (b'{"digest": 5, "seed": 3}', "digest"),
        (b'{"digest": "ab", "seed": 3, "more": 1}', "more"),
        (b'{"digest": "ab", "seed": -1}', "seed"),
        (b'{"digest": "' + b"a" * 9000 + b'", "seed": 3}', ""),
    ],
)
def test_bodies_that_are_not_greetings_are_refused(body: bytes, key: str) -> None:
    with pytest.raises(BodyError) as caught:
        Hello.unpack(body)
    wrong = "the body is not a JSON object"
    if key:
        wrong = f"key '{key}' is missing, unknown or has a wrong value"
    keys = f"digest (a text) and seed (an integer from 0 to {LARGEST_SEED})"
    assert str(caught.value) == f"HELLO: {wrong}; the keys must be exactly {keys}"
