"""Faults of a link, on request: a line that spoils answers as bad links and boards do."""

import random
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from spikeport.backends.board.frame import Frame, Kind
from spikeport.errors import BoardLostError
from spikeport.fault_plan import Fault, FaultPlan, Faults
from spikeport.pacing import Clock

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
"""The kinds of faults, and their effects on an answer."""
FAULTS = Faults("--fault", tuple(KINDS), timed=("slow",))


class Outlet(Protocol):
    """The sending half of a line."""

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
        Seed of the steps and bits that are drawn at random.
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
        self._rng = random.Random(seed)
        self._plan = FaultPlan(faults, self._rng)
        self._step, self._silent = 0, False
        self._kept: list[bytes] = []

    def send(self, frame: Frame) -> None:
        """Send a frame, spoilt by all faults of its step; each happens once."""
        if self._silent:
            return
        drawn: Iterable[Fault] = ()
        # A step that is requested again has had its faults.
        if frame.kind == Kind.STATE and frame.step != self._step:
            drawn, self._step = self._plan.drawn(frame.step), frame.step
        behind, self._kept = self._kept, []
        sent = [frame.encode()]
        for fault in drawn:
            sent = self._spoilt(sent, fault, frame)
        for data in (*sent, *behind):
            self._line.send_bytes(data)

    def _spoilt(self, sent: list[bytes], fault: Fault, frame: Frame) -> list[bytes]:
        """Return the bytes to send for a frame, after a fault has changed them."""
        match fault.kind:
            case "duplicate":
                return sent * 2
            case "reorder":
                self._kept += sent
            case "flip":
                return [self._flipped(data) for data in sent]
            case "garbage":
                return [self._rng.randbytes(len(data)) for data in sent]
            case "wrong-step":
                return [frame._replace(step=frame.step + 3).encode() for _ in sent]
            case "wrong-session":
                return [frame._replace(session=frame.session ^ 5).encode() for _ in sent]
            case "slow":
                self._clock.sleep_until(self._clock.now() + fault.delay_s)
                return sent
            case "cut":
                raise BoardLostError("the fault plan hangs up")
            case "half-open":
                self._silent = True
            case "restart":
                self._restart()
        return []

    def _flipped(self, data: bytes) -> bytes:
        spoilt = bytearray(data)
        spoilt[self._rng.randrange(len(data))] ^= 1 << self._rng.randrange(8)
        return bytes(spoilt)
