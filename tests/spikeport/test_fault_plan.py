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


NO_KIND = "choose from: flip, loss, slow=MS; each with @STEP or :SHARE"
PLAIN = "; cure: write loss@STEP or loss:SHARE"
TIMED = "; cure: write slow=MS@STEP or slow=MS:SHARE"
STEPS = "a step is a whole number from 1 to 1,000,000,000"
TIMES = "a time is a decimal number from 0 to 1,000,000 ms"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", f"unknown kind of fault ''; {NO_KIND}"),
        ("lost@7", f"unknown kind of fault 'lost'; {NO_KIND}"),
        ("loss", f"it has neither a step nor a share{PLAIN}"),
        ("loss@", f"{STEPS}, found ''{PLAIN}"),
        ("loss@0", f"{STEPS}, found '0'{PLAIN}"),
        ("loss@1000000001", f"{STEPS}, found '1000000001'{PLAIN}"),
        ("loss@7:0.5", f"{STEPS}, found '7:0.5'{PLAIN}"),
        ("loss=3@7", f"loss has no time, found '3'{PLAIN}"),
        ("loss:1.5", f"a share is a decimal number from 0 to 1, found '1.5'{PLAIN}"),
        ("loss:.", f"a share is a decimal number from 0 to 1, found '.'{PLAIN}"),
        ("slow@7", f"slow needs a time in ms, found none{TIMED}"),
        ("slow:1", f"slow needs a time in ms, found none{TIMED}"),
        ("slow=.@1", f"{TIMES}, found '.'{TIMED}"),
        ("slow=1000001@3", f"{TIMES}, found '1000001'{TIMED}"),
    ],
)
def test_malformed_texts_of_faults_are_refused_with_the_forms_that_work(
    text: str, reason: str
) -> None:
    with pytest.raises(UsageError) as caught:
        FAULTS.parse(text)
    assert str(caught.value) == f"--fault {text!r}: {reason}"


@pytest.mark.parametrize("text", ["loss@", "loss:", "slow="])
def test_thousands_of_digits_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match=f"{'9' * 400}[.]{{3}}'; cure: write"):
        FAULTS.parse(text + "9" * 5000)


def test_a_fault_of_a_step_happens_once_and_before_random_ones() -> None:
    faults = [Fault("loss", step=3), Fault("slow", share=1.0, delay_s=0.01)]
    plan = FaultPlan(faults, random.Random(0))
    drawn = [[fault.kind for fault in plan.drawn(step)] for step in (1, 3, 3)]
    assert drawn == [["slow"], ["loss", "slow"], ["slow"]]


def test_all_faults_of_a_step_happen() -> None:
    plan = FaultPlan([Fault("loss", step=3), Fault("flip", step=3)], random.Random(0))
    assert [fault.kind for fault in plan.drawn(3)] == ["loss", "flip"]


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
