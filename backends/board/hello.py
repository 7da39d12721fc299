"""Bodies in JSON: the greeting of the host, and the welcome of the board."""

import json
from dataclasses import asdict, dataclass
from typing import Annotated, ClassVar, Self

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from spikeport.backends.board.messages import BodyError
from spikeport.constants import LARGEST_SEED
from spikeport.reading.mismatch import shown

MOST = 4096
"""Bytes in the largest body."""


@dataclass(frozen=True)
class Greeting:
    """A body in JSON, whose fields are checked when it is read; ``keys`` has them in words."""

    keys: ClassVar[str]
    __pydantic_config__ = ConfigDict(extra="forbid", strict=True)

    def pack(self) -> bytes:
        """Return the body."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def unpack(cls, body: bytes) -> Self:
        """Return the content of a body; BodyError if it does not have exactly these fields."""
        try:
            return TypeAdapter(cls).validate_json(body[:MOST])
        except ValidationError as error:
            wrong = "the body is not a JSON object"
            if key := ".".join(map(str, error.errors()[0]["loc"])):
                wrong = f"key '{shown(key)}' is missing, unknown or has a wrong value"
            raise BodyError(
                f"{cls.__name__.upper()}: {wrong}; the keys must be exactly {cls.keys}"
            ) from None


@dataclass(frozen=True)
class Hello(Greeting):
    """The host's greeting: the digest of the image that it wants to run, and the chip's seed."""

    digest: str
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)]
    keys = f"digest (a text) and seed (an integer from 0 to {LARGEST_SEED})"


@dataclass(frozen=True)
class Welcome(Greeting):
    """The board's answer once the chip is built and warm.

    Attributes
    ----------
    digest : str
        The digest of the image that it runs.
    runs : str
        The machine that it runs on.
    steps_per_s : float
        Steps per second of the chip alone, measured before the session.
    """

    digest: str
    runs: str
    steps_per_s: float
    keys = "digest, runs (texts) and steps_per_s (a number)"
