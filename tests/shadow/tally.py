"""Counts of the comparisons of each test."""

import json
from collections import Counter
from pathlib import Path

NO_EMULATOR = "makes no emulator"


class Tally:
    """Counter of steps, updates and spikes compared, under the test that runs."""

    def __init__(self) -> None:
        self.test = "outside tests"
        self.steps: Counter[str] = Counter()
        self.updates = 0
        self.spikes = 0
        self.mismatches: list[str] = []
        self.reasons: dict[str, str] = {}
        self.outcomes: dict[str, str] = {}
        self.errors: dict[str, str] = {}

    def begin(self, test: str) -> None:
        """Count all following steps for this test."""
        self.test = test

    def step(self, spikes: int, n: int) -> None:
        """Count one step in which both emulators were equal."""
        self.steps[self.test] += 1
        self.updates += int(n)
        self.spikes += int(spikes)

    def mismatch(self, what: str) -> None:
        """Note a difference of the emulators: a test may swallow the error."""
        self.mismatches.append(f"{self.test}: {what}")

    def say(self, reason: str) -> None:
        """Note why the steps of this test cannot be compared."""
        self.reasons[self.test] = reason

    def end(self, test: str, outcome: str, error: str = "") -> None:
        """Note that the test passed, failed or was skipped; a failure in any phase counts."""
        if self.outcomes.get(test) != "failed":
            self.outcomes[test] = outcome
            if outcome == "failed":
                self.errors[test] = error

    def of(self, outcome: str) -> list[str]:
        """Return the tests with this outcome."""
        return sorted(test for test, how in self.outcomes.items() if how == outcome)

    def not_covered(self) -> dict[str, dict[str, int]]:
        """Return by reason the tests that passed without a comparison, and their variants."""
        silent = [test for test in self.of("passed") if not self.steps[test]]
        reasons = {self.reasons.get(test, NO_EMULATOR) for test in silent}
        return {reason: self._variants(silent, reason) for reason in sorted(reasons)}

    def _variants(self, tests: list[str], reason: str) -> dict[str, int]:
        mine = [test for test in tests if self.reasons.get(test, NO_EMULATOR) == reason]
        return dict(sorted(Counter(test.partition("[")[0] for test in mine).items()))

    def write(self, path: Path) -> None:
        """Write all counts as JSON."""
        content = {
            "tests": {how: self.of(how) for how in ("passed", "failed", "skipped", "xfailed")},
            "errors": self.errors,
            "tests_compared": sum(1 for n in self.steps.values() if n),
            "steps": self.steps.total(),
            "updates": self.updates,
            "spikes": self.spikes,
            "mismatches": self.mismatches,
            "not_covered": self.not_covered(),
        }
        path.write_text(json.dumps(content, indent=2), encoding="utf-8")


TALLY = Tally()
