"""Violations of a network or a placement, row by row, and the error that carries all rows."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from spikeport.compile.ground.refusal import RefusedError
from spikeport.counted import counted
from spikeport.errors import CompileError

MOST_NAMED = 8
"""The most objects that a line names, if several break a rule in the same way."""
HINTS_NAMED = 3
"""The most objects that a line of hints names, each with what was found."""


class Violation(NamedTuple):
    """One broken rule.

    ``id`` and ``rule`` are the rule's id and name, ``object`` the Nengo object or core that breaks
    it, ``used`` the amount found, ``limit`` the amount allowed, ``cure`` the smallest change that
    helps.
    """

    id: str
    rule: str
    object: str
    used: str
    limit: str
    cure: str

    def or_else(self, cure: str) -> "Violation":
        """Return the violation with another cure behind its own."""
        return self._replace(cure=f"{self.cure}, or {cure}")

    def __str__(self) -> str:
        limit = f", limit {self.limit}" if self.limit else ""
        return f"{self.object}: {self.id} {self.rule}: {self.used}{limit}; cure: {self.cure}"


class DoesNotFitError(RefusedError):
    """The error of a network that breaks rules of the chip; ``violations`` holds all of them.

    ``owners`` maps a core in a violation to the names of the network's objects on it.
    """

    def __init__(
        self,
        chip: str,
        violations: Iterable[Violation],
        owners: Mapping[str, tuple[str, ...]] | None = None,
    ) -> None:
        self.chip = chip
        self.violations = tuple(violations)
        self.owners = owners or {}
        super().__init__(f"the network does not fit chip '{chip}':\n{_rows(self.violations)}")

    def with_cures(self, cures: Mapping[str, str]) -> "DoesNotFitError":
        """Return the error with other cures for some rules, by id: those of a kind of network."""
        own = [one._replace(cure=cures.get(one.id, one.cure)) for one in self.violations]
        error = DoesNotFitError(self.chip, own, self.owners)
        error.advice = self.advice
        return error


class NothingOnChipError(DoesNotFitError):
    """The error of a network without an ensemble on the chip, so that there is no image.

    The network is not at fault: all of it runs on the host.

    Attributes
    ----------
    offloaded : tuple of Offloaded
        The ensembles that were on the chip before they were moved to the host.
    """

    offloaded: tuple["Offloaded", ...] = ()

    @property
    def verdict(self) -> str:
        """The place where the network runs instead, in words."""
        why = f"{len(self.offloaded)} moved" if self.offloaded else self.violations[0].used
        return (
            f"no ensemble of the network is on the chip ({why}): all of it runs on the host, in "
            "float Nengo"
        )

    def __str__(self) -> str:
        """Return where the network runs, and which ensembles were moved there."""
        return "\n".join([f"{self.verdict}; there is no image", *map(str, self.offloaded)])


class Offloaded(NamedTuple):
    """An ensemble that was moved to the host, and the violation that it was moved for.

    ``id``, ``rule`` and ``violator`` are those of the violation; ``host_spikes`` is the largest
    number of spikes that the ensemble, now on the host, sends to the chip in a step.
    """

    object: str
    n_neurons: int
    id: str
    rule: str
    violator: str
    host_spikes: int

    def __str__(self) -> str:
        because = f"{self.id} {self.rule}".strip()
        return (
            f"{self.object} ({counted(self.n_neurons, 'neuron')}) to the host: {because} of "
            f"{self.violator}; adds at most {counted(self.host_spikes, 'host spike')} a step"
        )


class OnHost(NamedTuple):
    """An ensemble that is not meant for the chip, and the reason for that."""

    object: str
    n_neurons: int
    reason: str


def on_host_lines(ensembles: Iterable[OnHost]) -> list[str]:
    """Return a line for each reason, with the ensembles that it keeps on the host."""
    alike: dict[str, list[OnHost]] = {}
    for one in ensembles:
        alike.setdefault(one.reason, []).append(one)
    lines = []
    for reason, found in alike.items():
        n = sum(one.n_neurons for one in found)
        names = listed([one.object for one in found])
        lines.append(f"{names} ({counted(n, 'neuron')}): {reason}")
    return lines


def hint_lines(hints: Iterable[Violation]) -> list[str]:
    """Return a line for each rule and cure, with the first objects that it concerns."""
    # A rule's cure may have a number for its object.
    alike: dict[tuple[str, str], list[Violation]] = {}
    for hint in hints:
        alike.setdefault((hint.id, hint.cure), []).append(hint)
    lines = []
    for found in alike.values():
        named = [f"{hint.object} ({hint.used})" for hint in found[:HINTS_NAMED]]
        more = [f"{len(found) - HINTS_NAMED} more"] if len(found) > HINTS_NAMED else []
        first = found[0]
        lines.append(f"{first.id} {first.rule}: {', '.join([*named, *more])}; cure: {first.cure}")
    return lines


class OverBudgetError(CompileError):
    """The error of a network over budget; ``violations`` holds every budget that is exceeded."""

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(violations)
        super().__init__(f"the network exceeds its budget:\n{_rows(self.violations)}")


def _rows(violations: Sequence[Violation]) -> str:
    """Return lines of violations by rule; violations that differ only in object share a line."""
    alike: dict[Violation, list[str]] = {}
    for violation in sorted(violations, key=lambda violation: violation.id):
        alike.setdefault(violation._replace(object=""), []).append(violation.object)
    lines = [f"  {one._replace(object=listed(names))}" for one, names in alike.items()]
    return "\n".join([*lines, f"more: spikeport compile --explain {next(iter(alike)).id}"])


def listed(names: Sequence[str]) -> str:
    """Return the first names in natural order (name2 before name10), and the number of others."""
    ordered = sorted(names, key=_by_number)
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(ordered[:MOST_NAMED]) + more


def _by_number(name: str) -> list[tuple[int, str]]:
    # Every second part is a number: with more digits, it is larger.
    return [(i % 2 * len(part), part) for i, part in enumerate(re.split("([0-9]+)", name))]
