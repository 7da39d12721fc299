"""Violations of a network or a placement, row by row, and the error that carries all rows."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from spikeport.compile.ground.refusal import RefusedError
from spikeport.errors import CompileError


class Violation(NamedTuple):
    """One broken rule.

    ``id`` and ``rule`` are the rule's, ``object`` the Nengo object or core it concerns, ``used``
    and ``limit`` what was found against what is allowed, ``cure`` the smallest change that helps.
    """

    id: str
    rule: str
    object: str
    used: str
    limit: str
    cure: str

    def __str__(self) -> str:
        limit = f", limit {self.limit}" if self.limit else ""
        return f"{self.object}: {self.id} {self.rule}: {self.used}{limit}; cure: {self.cure}"


class DoesNotFitError(RefusedError):
    """The error of a network that breaks rules of the chip; ``violations`` holds all of them."""

    def __init__(self, chip: str, violations: Iterable[Violation]) -> None:
        self.chip = chip
        self.violations = tuple(violations)
        super().__init__(f"the network does not fit chip '{chip}':\n{_rows(self.violations)}")


class OverBudgetError(CompileError):
    """The error of a network over budget; ``violations`` holds every budget that is exceeded."""

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(violations)
        super().__init__(f"the network exceeds its budget:\n{_rows(self.violations)}")


def _rows(violations: Sequence[Violation]) -> str:
    """Return every violation on a line, and the way to learn more."""
    lines = [f"  {violation}" for violation in violations]
    return "\n".join([*lines, f"more: spikeport compile --explain {violations[0].id}"])
