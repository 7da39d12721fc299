"""Plans of faults: their texts, their refusals, and the steps at which faults happen."""

import random

import pytest

from spikeport.errors import UsageError
from spikeport.fault_plan import Fault, FaultPlan, Faults, unreached

FAULTS = Faults("--fault", ("loss", "flip", "slow"), timed=("slow",))


def test_texts_of_faults_are_parsed() -> None:
    assert FAULTS.parse("loss@7") == Fault("loss", step=7)
    assert FAULTS.parse("slow=2.5@7") == Fault("slow", step=7, delay_s=0.0025)
    assert FAULTS.parse("slow=2.5:1") == Fault("slow", share=1.0, delay_s=0.0025)
    assert FAULTS.parse("flip:0.01") == Fault("flip", share=0.01)


@pytest.mark.parametrize(
    "text", ["", "loss", "loss@", "lost@7", "slow@7", "loss=3@7", "flip:1.5", "flip:.", "slow=.@1"]
)
def test_malformed_texts_of_faults_are_refused(text: str) -> None:
    with pytest.raises(
        UsageError, match=r"write KIND@STEP, slow=MS@STEP or KIND:SHARE, with a kind of loss"
    ):
        FAULTS.parse(text)


def test_a_fault_of_a_step_happens_once_and_before_random_ones() -> None:
    faults = [Fault("loss", step=3), Fault("slow", share=1.0, delay_s=0.01)]
    plan = FaultPlan(faults, random.Random(0))
    drawn = [[fault.kind for fault in plan.drawn(step)] for step in (1, 3, 3)]
    assert drawn == [["slow"], ["loss", "slow"], ["slow"]]


def test_all_faults_of_a_step_happen() -> None:
    plan = FaultPlan([Fault("loss", step=3), Fault("flip", step=3)], random.Random(0))
    assert [fault.kind for fault in plan.drawn(3)] == ["loss", "flip"]


@pytest.mark.parametrize("step", ["0", "1000000001", "9" * 5000])
def test_a_step_below_1_or_beyond_the_longest_run_is_refused(step: str) -> None:
    with pytest.raises(UsageError) as caught:
        FAULTS.parse(f"loss@{step}")
    assert str(caught.value) == f"--fault 'loss@{step}': steps count from 1 to 1,000,000,000"


@pytest.mark.parametrize("ms", ["1000001", "9" * 5000])
def test_a_delay_above_1000_s_is_refused(ms: str) -> None:
    with pytest.raises(UsageError, match=r"@3': the time is at most 1,000,000 ms$"):
        FAULTS.parse(f"slow={ms}@3")


def test_faults_of_a_share_are_drawn_from_the_seeded_generator() -> None:
    def drawn(seed: int) -> list[bool]:
        plan = FaultPlan([Fault("loss", share=0.3)], random.Random(seed))
        return [bool(plan.drawn(step)) for step in range(1000)]

    assert drawn(1) == drawn(1) != drawn(2)
    assert 250 < sum(drawn(1)) < 350


def test_faults_beyond_the_end_of_the_run_are_named() -> None:
    plan = [FAULTS.parse(text) for text in ("loss@5", "slow=2.5@6", "flip:0.1", f"loss@{10**9}")]
    assert unreached(plan, 5) == [
        "fault slow=2.5@6 was never reached: the run has 5 steps",
        f"fault loss@{10**9} was never reached: the run has 5 steps",
    ]
    assert unreached(plan, 0) == []
