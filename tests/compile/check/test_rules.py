import inspect
import re

import pytest

from spikeport.compile.check import lint, rules
from spikeport.compile.check.violation import Violation
from spikeport.errors import UsageError
from spikeport.files import read_toml
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.limits import CoreUse, usages


def test_rule_ids_are_unique_and_sorted_and_of_a_known_group() -> None:
    ids = [row["id"] for row in read_toml(rules.FILE)["rules"]]
    assert ids == sorted(set(ids))
    assert all(re.fullmatch(r"SP\d{3}", one) and one[:3] in rules.GROUPS for one in ids)


def test_rule_names_are_unique() -> None:
    names = [rule.name for rule in rules.RULES.values()]
    assert len(set(names)) == len(names)


def test_every_limit_of_a_chip_has_a_rule() -> None:
    of_chips = {r.name for r in rules.RULES.values() if r.id[:3] in ("SP1", "SP2")}
    checked = usages([CoreUse("a core", *[0] * 7)], chips.get("softcore-ecp5-85f"))
    of_limits = {usage.resource.replace("_", "-") for usage in checked}
    assert of_chips == of_limits | {"shared settings", "learning synapses", "refractory period"}


def test_every_rule_of_networks_is_checked() -> None:
    of_networks = {one for one in rules.RULES if one.startswith("SP0")}
    of_networks -= {"SP012"}  # checked on the blocks that nengo-loihi built
    assert set(re.findall(r'rules\.get\("(SP0\d\d)"\)', inspect.getsource(lint))) == of_networks
    assert len(lint.RULES) == len(of_networks)


def test_a_rule_is_found_by_its_id_in_either_case() -> None:
    assert rules.get("sp101") is rules.RULES["SP101"]
    assert rules.get("SP101").name == "out-axons"


def test_the_error_for_an_unknown_id_lists_all_rules() -> None:
    with pytest.raises(UsageError) as raised:
        rules.get("SP999")
    assert str(raised.value) == f"unknown rule 'SP999'; choose from: {', '.join(rules.RULES)}"


def test_the_numbers_of_a_violation_are_filled_into_its_cure() -> None:
    assert rules.get("SP102").broken("a", "8,193", "4,096", parts=3) == Violation(
        "SP102",
        "in-axons",
        "a",
        "8,193",
        "4,096",
        "split the source ensemble into 3 that decode into the same target, "
        "each with the targets divided by 3, or, if the source is on the host, let the target read "
        "fewer of its values",
    )


def test_cures_listed_for_a_rule_have_letters_in_place_of_numbers() -> None:
    # Braces with an option of a pass, as in sparse_inputs{weight=n}, are text.
    cures = [cure for rule in rules.RULES.values() for cure in rule.cures]
    assert not [cure for cure in cures if re.search(r"\{\w*\}", cure)]
    assert rules.get("SP501").cures[0].startswith("compile it on a machine with n GB to spare")


def test_a_limit_that_is_the_same_for_every_chip_comes_with_the_rule() -> None:
    assert str(rules.get("SP003").broken("a", "WhiteNoise")) == (
        "a: SP003 ensemble noise: WhiteNoise, limit none; cure: remove the noise, or keep it on "
        "the host with net.config[ensemble].on_chip = False, after spikeport.add_params(net)"
    )
