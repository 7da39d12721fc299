"""Reports on networks that are refused."""

from spikeport.compile.check.finite import not_finite
from spikeport.compile.check.violation import DoesNotFitError, Violation
from spikeport.compile.ground.refusal import RefusedError, concerning
from spikeport.compile.report.refusal import refused_report
from spikeport.compile.report.schema import ReportData
from spikeport.hardware_models import chip as chips

CHIP = chips.get("loihi")


def data(error):
    found = ReportData.model_validate(refused_report(CHIP, error).to_dict())
    assert (found.fits, found.image_digest, found.cores) == (False, "", [])
    return found


def test_a_builders_refusal_is_a_violation_of_no_rule():
    error = concerning(("a -> b", "a", "b"), RefusedError("a -> b: nengo-loihi: no; cure: two"))
    found = data(error)
    assert found.verdict == "does not fit chip 'loihi': its builder refuses it"
    (violation,) = refused_report(CHIP, error).violations
    words = ("", "refused by the builder", "a -> b", "nengo-loihi: no", "", "two")
    assert violation == Violation(*words)
    (unnamed,) = refused_report(CHIP, RefusedError("no")).violations
    assert unnamed == Violation("", "refused by the builder", "the network", "no", "", "")


def test_broken_rules_are_listed():
    row = Violation("SP101", "axons", "core 0", "5", "4", "less")
    assert refused_report(CHIP, DoesNotFitError("loihi", [row])).violations == (row,)
    found = data(not_finite("a", "its bias"))
    assert found.verdict == "does not fit chip 'loihi': breaks SP011"
    assert found.violations[0].object == "a"
