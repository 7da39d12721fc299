"""Faults of a link, on request: a line that does to answers what bad links and boards do.

They are written as ``KIND@STEP``, ``slow=MS@STEP``, or ``KIND:SHARE`` for a share of all steps,
drawn from a seed.
"""

import random
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.line import Clock
from spikeport.errors import BoardLostError, UsageError

KINDS = {
    "loss": "the answer is never sent",
    "duplicate": "it is sent twice",
    "reorder": "it is sent after the next one",
    "flip": "one of its bits is flipped",
    "garbage": "other bytes are sent in its place",
    "wrong-step": "it has the number of another step",
    "wrong-session": "it has the number of another session",
    "slow": "it is sent so many ms later",
    "cut": "the board hangs up",
    "half-open": "the board falls silent",
    "restart": "the board starts anew, at rest, on the same connection",
}
"""The kinds of faults, and what becomes of an answer."""
PATTERN = re.compile(r"(?P<kind>[a-z-]+)(=(?P<ms>[0-9.]+))?(@(?P<step>[0-9]+)|:(?P<share>[0-9.]+))")
FORM = "write KIND@STEP, slow=MS@STEP or KIND:SHARE, with a kind of " + ", ".join(KINDS)


@dataclass(frozen=True)
class Fault:
    """A fault at one step, or, with step 0, at a share of all."""

    kind: str
    step: int = 0
    share: float = 0.0
    delay_s: float = 0.0

    @classmethod
    def parse(cls, text: str) -> "Fault":
        """Return the fault that a text names; UsageError if it names none."""
        found = PATTERN.fullmatch(text)
        if found is None or found["kind"] not in KINDS:
            raise UsageError(f"--fault {text!r}: {FORM}")
        try:
            delay_s, share = float(found["ms"] or 0) / 1000, float(found["share"] or 0)
        except ValueError:
            raise UsageError(f"--fault {text!r}: {FORM}") from None
        if (found["kind"] == "slow") != (found["ms"] is not None) or share > 1:
            raise UsageError(f"--fault {text!r}: {FORM}")
        return cls(found["kind"], int(found["step"] or 0), share, delay_s)


class Outlet(Protocol):
    """The sending half of a line."""

    def send(self, frame: Frame) -> None:
        """Send a frame."""

    def send_bytes(self, data: bytes) -> None:
        """Send bytes as they are."""


class FaultyLine:
    """A line of the board that spoils answers to steps by a plan.

    Parameters
    ----------
    line : Outlet
        The line.
    faults : sequence of Fault
        The plan.
    clock : Clock
        The clock of delays.
    restart : callable
        Starts the board anew.
    seed : int
        Draws the steps of shares.
    """

    def __init__(
        self,
        line: Outlet,
        faults: Sequence[Fault],
        clock: Clock,
        restart: Callable[[], None],
        seed: int = 0,
    ) -> None:
        self._line, self._clock, self._restart = line, clock, restart
        self._at = {fault.step: fault for fault in faults if fault.step}
        self._shares = [fault for fault in faults if not fault.step]
        self._rng = random.Random(seed)
        self._silent = False
        self._kept: Frame | None = None

    def send(self, frame: Frame) -> None:
        """Send a frame, spoilt where the plan has it so; a fault happens once a step."""
        if self._silent:
            return
        fault = self._fault(frame) if frame.kind == Kind.STATE else None
        if fault is None:
            self._line.send(frame)
        else:
            self._spoil(frame, fault)
        if self._kept is not None and self._kept is not frame:
            self._line.send(self._kept)
            self._kept = None

    def _fault(self, frame: Frame) -> Fault | None:
        drawn = [fault for fault in self._shares if self._rng.random() < fault.share]
        return self._at.pop(frame.step, None) or next(iter(drawn), None)

    def _spoil(self, frame: Frame, fault: Fault) -> None:
        match fault.kind:
            case "duplicate":
                self._line.send(frame)
                self._line.send(frame)
            case "reorder":
                self._kept = frame
            case "flip":
                data = bytearray(frame.encode())
                data[self._rng.randrange(len(data))] ^= 1 << self._rng.randrange(8)
                self._line.send_bytes(bytes(data))
            case "garbage":
                self._line.send_bytes(self._rng.randbytes(len(frame.encode())))
            case "wrong-step":
                self._line.send(frame._replace(step=frame.step + 3))
            case "wrong-session":
                self._line.send(frame._replace(session=frame.session ^ 5))
            case "slow":
                self._clock.sleep_until(self._clock.now() + fault.delay_s)
                self._line.send(frame)
            case "cut":
                raise BoardLostError("the fault plan hangs up")
            case "half-open":
                self._silent = True
            case "restart":
                self._restart()
