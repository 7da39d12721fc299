"""The cures of all rules, each carried out on a network that breaks the rule."""

import pytest

from spikeport.compile.check.rules import RULES
from tests.helpers import chip_cures, hint_cures, network_cures
from tests.helpers.cured import Case

CASES = [*network_cures.CASES, *chip_cures.CASES, *hint_cures.CASES]


def test_every_cure_of_every_rule_has_a_case() -> None:
    cures = [(one.id, cure) for one in RULES.values() for cure in one.templates]
    for rule, cure in cures:
        cases = [one for one in CASES if one.rule == rule and cure.startswith(one.cure)]
        assert len(cases) == 1, f"{rule}: {cure}"
    assert len(CASES) == len(cures)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.rule}-{case.cure[:20]}")
def test_a_cured_network_no_longer_breaks_the_rule(case: Case) -> None:
    assert case.rule in case.broken()
    for cured in case.cured:
        found = cured()
        assert case.rule not in found
        if case not in hint_cures.CASES:
            assert found == set(), "it still does not compile"
