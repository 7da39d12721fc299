"""The report on a network that does not fit, or that a builder refuses."""

from spikeport.compile.check.finite import NotFiniteError
from spikeport.compile.check.violation import DoesNotFitError, Violation
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.report.report import Report
from spikeport.hardware_models.chip import ChipModel

CURE = "; cure: "
"""The text between the reason and the cure in the message of an error."""


def refused_report(chip: ChipModel, error: RefusedError) -> Report:
    """Return a report without cores, whose violations say why the network is refused."""
    return Report(chip, "", (), (), (), violations=_violations(error))


def _violations(error: RefusedError) -> tuple[Violation, ...]:
    """Return the broken rules, or the words of a builder as a violation of no rule."""
    if isinstance(error, DoesNotFitError | NotFiniteError):
        return error.violations
    name = error.about[0] if error.about else "the network"
    used, _, cure = str(error).partition(CURE)
    words = used.removeprefix(f"{name}: ")
    return (Violation("", "refused by the builder", name, words, "", cure),)
