import math

import pytest

from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.compile.report.budget import Budget
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity


@pytest.fixture
def activity(compiled_chain: Compilation) -> Activity:
    return expected_activity(compiled_chain.image, Rates(100))


def test_a_network_within_its_budget_exceeds_nothing(compiled_chain: Compilation, activity) -> None:
    assert Budget().exceeded(compiled_chain.report, None) == ([], None)
    budget = Budget(cores=4, power_w=0.2, step_us=100)
    assert budget.exceeded(compiled_chain.report, activity) == ([], None)


def test_every_budget_that_is_exceeded_is_named(chain, activity) -> None:
    report = compile_network(chain(), pipeline="").report
    found, unknown = Budget(cores=2, power_w=0.1, step_us=0.5).exceeded(report, activity)
    assert unknown is None
    assert [(v.id, v.object, v.limit) for v in found] == [
        ("SP301", "loihi", "2"),
        ("SP302", "loihi", "0.1 W"),
        ("SP303", "loihi", "0.5 us"),
    ]
    assert str(found[0]) == (
        "loihi: SP301 max-cores: 4, limit 2; cure: use fewer or smaller ensembles or fewer decoded "
        "connections, or raise --max-cores"
    )


def test_the_costliest_calibration_counts(compiled_chain: Compilation, activity) -> None:
    (violation,), _ = Budget(power_w=0.1).exceeded(compiled_chain.report, activity)
    assert violation.used.endswith(", nahuku-fit")


def test_a_budget_that_is_a_rounded_cost_does_not_look_like_the_cost(
    compiled_chain: Compilation, activity
) -> None:
    (violation,), _ = Budget(power_w=0.104).exceeded(compiled_chain.report, activity)
    assert (violation.used, violation.limit) == (
        "104.01 mW [29.0075, 110.011], nahuku-fit",
        "0.104 W",
    )


@pytest.mark.parametrize(
    ("power_w", "cure"),
    [
        (0.0001, "raise --max-power above 104 mW [29, 110], which the chip draws whatever the"),
        (0.104, "raise --max-power above 104 mW [29, 110], which the chip draws whatever the"),
        (0.1040001, "lower the firing rates"),
    ],
)
def test_a_limit_below_the_power_at_rest_is_cured_by_a_higher_limit_alone(
    compiled_chain: Compilation, activity, power_w: float, cure: str
) -> None:
    (violation,), _ = Budget(power_w=power_w).exceeded(compiled_chain.report, activity)
    assert violation.cure.startswith(cure)


@pytest.mark.parametrize("budget", [Budget(power_w=1), Budget(step_us=1)])
def test_a_budget_of_power_or_time_needs_firing_rates(
    compiled_chain: Compilation, budget: Budget
) -> None:
    with pytest.raises(UsageError, match=r"^--max-(power|step-us) needs firing rates: set them "):
        budget.exceeded(compiled_chain.report, None)


def test_a_chip_without_figures_cannot_be_held_to_a_budget(chain, activity) -> None:
    report = compile_network(chain(), chip="loihi2", pipeline="").report
    found, unknown = Budget(cores=1, power_w=1, step_us=1).exceeded(report, activity)
    assert [one.id for one in found] == ["SP301"]  # which is not lost
    assert str(unknown) == ("--max-power: chip 'loihi2' has no public figure to compare it with")


def test_a_chip_whose_power_at_rest_alone_is_too_much_exceeds_a_budget(chain, activity) -> None:
    report = compile_network(chain(), chip="loihi2").report  # without dynamic energies
    (violation,), _ = Budget(power_w=0.01).exceeded(report, activity)
    assert (violation.id, violation.used) == ("SP302", "280 mW [no interval], at rest")
    assert violation.cure.startswith("raise --max-power above 280 mW")


STATIC_POWER = """
[power.static_chip_w]
value = 0.5
unit = "W"
source = "a data sheet"
evidence = "vendor"
"""


def test_power_without_the_static_part_is_not_within_a_budget(chain, activity, tmp_path) -> None:
    report = compile_network(chain(), chip="spinnaker2").report
    (violation,), _ = Budget(power_w=1e-6).exceeded(report, activity)
    assert violation.id == "SP302"
    found, unknown = Budget(power_w=1).exceeded(report, activity)
    assert found == []
    assert str(unknown) == (
        "--max-power: chip 'spinnaker2' has no public static power, so that its power is not known "
        "to be within a limit; cure: give power.static_chip_w in a chip file of your own"
    )
    own = tmp_path / "own.toml"
    own.write_text((chips.BUILT_IN / "spinnaker2.toml").read_text() + STATIC_POWER)
    cured = compile_network(chain(), chip=own).report
    assert Budget(power_w=1).exceeded(cured, activity) == ([], None)
    (violation,), _ = Budget(power_w=0.4).exceeded(cured, activity)
    assert violation.id == "SP302"


@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf])
def test_a_budget_that_is_not_a_positive_number_is_refused(value: float) -> None:
    with pytest.raises(UsageError) as raised:
        Budget(step_us=value)
    assert str(raised.value) == f"--max-step-us {value}: a budget is a positive number"


def test_a_budget_of_cores_may_be_larger_than_any_float() -> None:
    Budget(cores=10**400)
    with pytest.raises(UsageError, match="--max-cores -1000"):
        Budget(cores=-(10**400))
