"""Greetings come back, and others are refused by field."""

import pytest

from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.messages import BodyError


def test_greetings_come_back() -> None:
    hello, welcome = Hello("ab", 3), Welcome("ab", "native", 5300.5)
    assert Hello.unpack(hello.pack()) == hello
    assert Welcome.unpack(welcome.pack()) == welcome


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"", "Hello : Invalid JSON"),
        (b"[]", "Hello : "),
        (b'{"digest": "ab"}', "Hello seed: Field required"),
        (b'{"digest": 5, "seed": 3}', "Hello digest: Input should be a valid string"),
        (b'{"digest": "ab", "seed": 3, "more": 1}', "Hello more: "),
        (b'{"digest": "ab", "seed": -1}', "seed -1, at most"),
        (b'{"digest": "' + b"a" * 9000 + b'", "seed": 3}', "Hello : Invalid JSON"),
    ],
)
def test_other_bodies_are_refused(body: bytes, reason: str) -> None:
    with pytest.raises(BodyError, match=reason):
        Hello.unpack(body)
