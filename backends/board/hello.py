"""Bodies in JSON: the greeting of the host, and the welcome of the board."""

import json
from dataclasses import asdict, dataclass
from typing import Self

from pydantic import ConfigDict, TypeAdapter, ValidationError

from spikeport.backends.board.messages import BodyError
from spikeport.constants import LARGEST_SEED

MOST = 4096
"""Bytes in the largest of them."""


@dataclass(frozen=True)
class Greeting:
    """A body in JSON, whose fields are checked when it is read."""

    __pydantic_config__ = ConfigDict(extra="forbid", strict=True)

    def pack(self) -> bytes:
        """Return the body."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def unpack(cls, body: bytes) -> Self:
        """Return the content of a body; BodyError if it is another one."""
        try:
            return TypeAdapter(cls).validate_json(body[:MOST])
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise BodyError(f"{cls.__name__} {where}: {first['msg']}") from None


@dataclass(frozen=True)
class Hello(Greeting):
    """The host's greeting: the digest of the image that it wants to run, and the chip's seed."""

    digest: str
    seed: int

    def __post_init__(self) -> None:
        """Raise BodyError for a seed that NumPy does not take."""
        if not 0 <= self.seed <= LARGEST_SEED:
            raise BodyError(f"seed {self.seed}, at most {LARGEST_SEED}")


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
        Steps a second of the chip alone, measured before the session.
    """

    digest: str
    runs: str
    steps_per_s: float
