"""What is wrong with a network or a placement, row by row, and the error that carries all rows."""

from collections.abc import Iterable
from typing import NamedTuple

from spikeport.errors import CompileError


class Violation(NamedTuple):
    """One broken rule.

    ``object`` is the Nengo object or core it concerns, ``rule`` the name of the rule, ``used`` and
    ``limit`` what was found against what is allowed, ``cure`` the smallest change that helps.
    """

    object: str
    rule: str
    used: str
    limit: str
    cure: str

    def __str__(self) -> str:
        return f"{self.object}: {self.rule}: {self.used}, limit {self.limit}; cure: {self.cure}"


class DoesNotFitError(CompileError):
    """A network breaks rules of the chip; ``violations`` holds every one of them."""

    def __init__(self, chip: str, violations: Iterable[Violation]) -> None:
        self.chip = chip
        self.violations = tuple(violations)
        rows = "\n".join(f"  {v}" for v in self.violations)
        super().__init__(f"the network does not fit chip '{chip}':\n{rows}")
