"""Plans of faults: texts ``KIND@STEP``, or ``KIND:SHARE`` of all steps.

Some kinds have a time, as in ``KIND=MS@STEP`` and ``KIND=MS:SHARE``. The kinds, and their effects,
are defined by the link that has them.
"""

import math
import random
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from spikeport.constants import LONGEST_RUN
from spikeport.counted import counted
from spikeport.errors import UsageError, unknown
from spikeport.reading.mismatch import shown

MOST_MS = 10**6
"""The longest time of a fault, in ms: no system can wait for some 10^12."""
_PARTS = re.compile(r"([^=@:]*)(?:=([^@:]*))?([@:])?(.*)", re.DOTALL)
"""The parts of every text: a kind, a time in ms, ``@`` or ``:``, and a step or a share."""
_WHOLE, _DECIMAL = r"[0-9]+", r"[0-9]+\.?[0-9]*|\.[0-9]+"


class _Number(NamedTuple):
    """A number of a fault: its rule in words, the form of its text, and its limits."""

    rule: str
    form: str
    low: float
    high: float

    def read(self, text: str) -> float:
        """Return the number in a text; ValueError if it breaks the rule."""
        value = float(text) if re.fullmatch(self.form, text) else math.nan
        if not self.low <= value <= self.high:
            raise ValueError(f"{self.rule}, found '{shown(text)}'")
        return value


_TIME_MS = _Number(f"a time is a decimal number from 0 to {MOST_MS:,} ms", _DECIMAL, 0, MOST_MS)
_STEP = _Number(f"a step is a whole number from 1 to {LONGEST_RUN:,}", _WHOLE, 1, LONGEST_RUN)
_SHARE = _Number("a share is a decimal number from 0 to 1", _DECIMAL, 0, 1)


@dataclass(frozen=True)
class Fault:
    """A fault at one step, or, with step 0, at a share of all steps; ``text`` is the user's."""

    kind: str
    step: int = 0
    share: float = 0.0
    delay_s: float = 0.0
    text: str = field(default="", compare=False)


class Faults(NamedTuple):
    """The faults that a link can have.

    Attributes
    ----------
    option : str
        The option that asks for them.
    kinds : tuple of str
        The names of the kinds.
    timed : tuple of str
        The kinds that take a time in ms.
    """

    option: str
    kinds: tuple[str, ...]
    timed: tuple[str, ...]

    def parse(self, text: str) -> Fault:
        """Return the fault that a text names; UsageError if it names none."""
        parts = _PARTS.fullmatch(text)
        assert parts is not None  # as every text has these parts
        kind, ms, at, when = parts.groups()
        stems = {one: f"{one}=MS" if one in self.timed else one for one in self.kinds}
        if kind not in stems:
            reason = unknown("kind of fault", shown(kind), stems.values())
            raise UsageError(f"{self.option} {text!r}: {reason}; each with @STEP or :SHARE")
        try:
            delay_s = self._delay_s(kind, ms)
            step, share = _step_and_share(at, when)
        except ValueError as error:
            cure = f"write {stems[kind]}@STEP or {stems[kind]}:SHARE"
            raise UsageError(f"{self.option} {text!r}: {error}; cure: {cure}") from None
        return Fault(kind, step, share, delay_s, text)

    def _delay_s(self, kind: str, ms: str | None) -> float:
        if kind in self.timed and ms is None:
            raise ValueError(f"{kind} needs a time in ms, found none")
        if kind not in self.timed and ms is not None:
            raise ValueError(f"{kind} has no time, found '{shown(ms)}'")
        return 0.0 if ms is None else _TIME_MS.read(ms) / 1000


def _step_and_share(at: str | None, when: str) -> tuple[int, float]:
    """Return the step of a fault, or 0 and the share of all steps."""
    if at is None:
        raise ValueError("it has neither a step nor a share")
    return (int(_STEP.read(when)), 0.0) if at == "@" else (0, _SHARE.read(when))


def unreached(faults: Iterable[Fault], steps: int, run: str = "the run") -> list[str]:
    """Return a line for each fault beyond the last step of a run; none for a run of no steps."""
    return [
        f"fault {fault.text} was never reached: {run} has {counted(steps, 'step')}"
        for fault in faults
        if fault.step > steps > 0
    ]


class FaultPlan:
    """Faults by step; faults with a share are drawn at random.

    Parameters
    ----------
    faults : sequence of Fault
        The plan.
    rng : random.Random
        Draws the steps of faults with a share.
    """

    def __init__(self, faults: Sequence[Fault], rng: random.Random) -> None:
        self._at: dict[int, list[Fault]] = {}
        for fault in faults:
            if fault.step:
                self._at.setdefault(fault.step, []).append(fault)
        self._shares = [fault for fault in faults if not fault.step]
        self._rng = rng

    def drawn(self, step: int) -> Iterable[Fault]:
        """Return the faults of a step, planned ones before drawn ones; call it once a step."""
        shares = [fault for fault in self._shares if self._rng.random() < fault.share]
        return [*self._at.pop(step, ()), *shares]
