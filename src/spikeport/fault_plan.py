"""Plans of faults: texts ``KIND@STEP``, ``KIND=MS@STEP``, or ``KIND:SHARE`` of all steps.

The kinds, and their effects, are defined by the link that has them.
"""

import random
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from spikeport.constants import LONGEST_RUN
from spikeport.errors import UsageError
from spikeport.pacing import in_steps

MOST_MS = 10**6
"""The longest time of a fault, in ms: no system can wait for some 10^12."""
_PATTERN = re.compile(
    r"(?P<kind>[a-z-]+)(=(?P<ms>[0-9.]+))?(@(?P<step>[0-9]+)|:(?P<share>[0-9.]+))"
)


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
        found = _PATTERN.fullmatch(text)
        if found is None or found["kind"] not in self.kinds:
            raise self._refused(text)
        try:
            # The step as a float, too: Python makes no integer of thousands of digits.
            ms, share, step = (float(found[name] or 0) for name in ("ms", "share", "step"))
        except ValueError:
            raise self._refused(text) from None
        if (found["kind"] in self.timed) != (found["ms"] is not None) or share > 1:
            raise self._refused(text)
        if found["step"] is not None and not 1 <= step <= LONGEST_RUN:
            raise UsageError(f"{self.option} {text!r}: steps count from 1 to {LONGEST_RUN:,}")
        if ms > MOST_MS:
            raise UsageError(f"{self.option} {text!r}: the time is at most {MOST_MS:,} ms")
        return Fault(found["kind"], int(step), share, ms / 1000, text)

    def _refused(self, text: str) -> UsageError:
        timed = ", ".join(f"{kind}=MS@STEP" for kind in self.timed)
        return UsageError(
            f"{self.option} {text!r}: write KIND@STEP, {timed} or KIND:SHARE, with a kind of "
            + ", ".join(self.kinds)
        )


def unreached(faults: Iterable[Fault], steps: int, run: str = "the run") -> list[str]:
    """Return a line for each fault beyond the last step of a run; none for a run of no steps."""
    return [
        f"fault {fault.text} was never reached: {run} has {in_steps(steps)}"
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
