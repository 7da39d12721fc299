"""Faults that delay, lose, repeat, reorder or spoil messages, in the robot's own time."""

from collections.abc import Sequence

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.codec import Command
from spikeport.robot.link.faults import (
    FAULTS,
    KINDS,
    FaultyWay,
    never_reached,
    of_commands,
    of_states,
)
from spikeport.robot.link.h1 import DAMPING

STEP_MS = 5


def arrivals(*faults: str, steps: int = 6, seed: int = 0) -> list[list[int]]:
    """Return the commands that arrive in each step, numbered by the step that sent them."""
    plan = [FAULTS.parse(text) for text in faults]
    way = FaultyWay(STEP_MS, lambda it: it, plan, seed)
    found = []
    for step in range(1, steps + 1):
        way.send(step, STEP_MS * step, Command(step, DAMPING))
        found.append([command.answers for command in way.arrived(STEP_MS * step)])
    return found


def flat(found: Sequence[Sequence[int]]) -> list[int]:
    return [one for step in found for one in step]


def test_without_faults_each_command_arrives_in_its_step() -> None:
    assert arrivals() == [[1], [2], [3], [4], [5], [6]]


def test_a_delay_is_in_the_robots_time() -> None:
    assert arrivals("delay=10:1") == [[], [], [1], [2], [3], [4]]
    assert arrivals("delay=10@2") == [[1], [], [3], [2, 4], [5], [6]]


def test_losses_duplicates_reorderings_and_mutes_change_the_arrivals() -> None:
    assert arrivals("loss@3") == [[1], [2], [], [4], [5], [6]]
    assert arrivals("duplicate@3") == [[1], [2], [3], [4, 3], [5], [6]]
    assert arrivals("reorder@3") == [[1], [2], [], [4, 3], [5], [6]]
    assert arrivals("mute@3") == [[1], [2], [], [], [], []]


def test_a_share_of_losses_loses_that_share_of_commands() -> None:
    found = arrivals("loss:0.2", steps=2000)
    assert 1550 < len(flat(found)) < 1650


def test_jitter_is_exponential_of_its_mean_and_reorders_commands() -> None:
    found = arrivals("jitter=20:1", steps=4000)
    late = [STEP_MS * (step - one) for step, ones in enumerate(found, 1) for one in ones]
    for ms in range(0, 101, STEP_MS):
        # A command arrives in the first step after its jitter has passed.
        assert np.mean(np.array(late) > ms) == pytest.approx(np.exp(-ms / 20), abs=0.02)
    assert flat(found) != sorted(flat(found))


def test_plans_are_deterministic() -> None:
    plan = ("jitter=20:1", "loss:0.1")
    assert arrivals(*plan, steps=200) == arrivals(*plan, steps=200)
    assert arrivals(*plan, steps=200) != arrivals(*plan, steps=200, seed=1)


def test_a_message_is_spoilt_in_the_step_of_the_plan() -> None:
    way = FaultyWay(STEP_MS, str.upper, [FAULTS.parse("nan@2")])
    for step, message in enumerate("abc", 1):
        way.send(step, STEP_MS * step, message)
    assert way.arrived(3 * STEP_MS) == ["a", "B", "c"]


def test_faults_of_states_are_those_with_the_prefix_state() -> None:
    plan = [FAULTS.parse(text) for text in ("delay=10:1", "state-loss@3", "stop@9")]
    assert [fault.kind for fault in of_commands(plan)] == ["delay", "stop"]
    assert [(fault.kind, fault.step) for fault in of_states(plan)] == [("loss", 3)]


def test_every_kind_of_fault_can_be_parsed() -> None:
    for kind in KINDS:
        text = f"{kind}=2@2" if kind in FAULTS.timed else f"{kind}@2"
        assert FAULTS.parse(text).kind == kind


ALWAYS, ONLY_BEGUN = "the first state always arrives", "at its first step the robot has only begun"


@pytest.mark.parametrize(
    ("text", "reason"),
    [("state-nan@1", ALWAYS), ("state-delay=20@1", ALWAYS), ("restart@1", ONLY_BEGUN)],
)
def test_a_fault_of_the_first_step_that_cannot_be_is_refused(text: str, reason: str) -> None:
    with pytest.raises(UsageError) as caught:
        FAULTS._replace(option="--fault").parse(text)
    assert str(caught.value) == f"--fault '{text}': {reason}; cure: a step from 2 on"
    assert FAULTS.parse(text.replace("@1", ":1")).step == 0


def test_faults_beyond_the_last_command_or_state_are_reported_as_never_reached() -> None:
    """A run of six commands has seven states: the first one comes before any command."""
    plan = [FAULTS.parse(text) for text in ("loss@6", "loss@7", "state-loss@7", "state-loss@8")]
    assert never_reached(plan, 6) == [
        f"fault {text} was never reached: the robot's run has 6 steps"
        for text in ("loss@7", "state-loss@8")
    ]
