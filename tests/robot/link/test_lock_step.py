"""Lock-step: one step for each answer, and no step for anything else."""

from collections.abc import Sequence

import numpy as np
import pytest

from spikeport.robot.link.codec import (
    Command,
    Turn,
    decode_base,
    decode_state,
    encode_command,
    turn_of,
)
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.h1 import DAMPING
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.signals import MotorCommands
from spikeport.robot.walk_interface import POSE_RAD

HOLD = DAMPING._replace(q=POSE_RAD, kp=np.full(19, 100.0))


def lock_step(*faults: str, truth: bool = True) -> LockStep:
    robot = SimulatedRobot(RobotSettings(hoist=True))
    return LockStep(robot, [FAULTS.parse(text) for text in faults], truth)


def answer(one: LockStep, motors: MotorCommands = HOLD, tick: int | None = None) -> bool:
    command = Command(one.robot.tick if tick is None else tick, motors)
    return one.take_answer(encode_command(command), writer=1)


def run(one: LockStep, steps: int) -> dict[str, object]:
    for _ in range(steps):
        answer(one)
    return one.robot.summary()


def test_only_the_controllers_answer_to_the_current_state_makes_a_step() -> None:
    one = lock_step()
    assert answer(one)
    assert not answer(one, tick=5)  # an answer to the state before
    assert not answer(one, tick=500)
    assert not one.take_answer(b"nonsense", writer=1)
    assert not one.take_answer(encode_command(Command(one.robot.tick, HOLD)), writer=2)
    assert one.robot.steps == 1


def test_the_truth_has_the_tick_of_the_state_and_can_be_switched_off() -> None:
    one = lock_step()
    for tick in (5, 10, 15):
        truth = one.published().truth
        assert truth is not None
        assert decode_state(one.published().state)[0] == decode_base(truth).tick == tick
        answer(one)
    assert lock_step(truth=False).published().truth is None


@pytest.mark.parametrize(
    ("faults", "refused", "trips"),
    [
        ((), 0, 0),
        (("nan@7",), 1, 0),
        (("loss:0.2", "delay=40:1"), 0, 0),
        (("mute@50",), 0, 1),
    ],
)
def test_the_watchdog_is_tripped_by_silence_alone(
    faults: Sequence[str], refused: int, trips: int
) -> None:
    """With 40 ms of delay and a fifth of the commands lost, no gap lasts 100 ms."""
    found = run(lock_step(*faults), 400)
    assert found["steps"] == 400
    assert found["refused"]["beyond_limits"] == refused
    assert found["watchdog_trips"] == trips


def test_faults_are_deterministic() -> None:
    motions = [run(lock_step("jitter=10:1", "loss:0.1"), 100)["motion"] for _ in range(2)]
    assert motions[0] == motions[1] != run(lock_step(), 100)["motion"]


def lost_commands(seed: int) -> list[bool]:
    """Return which of 40 commands a robot with a seed did not get."""
    robot = SimulatedRobot(RobotSettings(seed=seed, hoist=True, watchdog_s=60.0))
    one, obeyed = LockStep(robot, [FAULTS.parse("loss:0.5")]), []
    for _ in range(40):
        before = robot.tick
        answer(one)
        obeyed.append(robot._obeyed_at == before)
    return [not got for got in obeyed]


def test_runs_with_other_seeds_draw_other_faults() -> None:
    """Otherwise several runs would show a single draw of the faults."""
    assert lost_commands(0) == lost_commands(0)
    assert lost_commands(0) != lost_commands(1) != lost_commands(2)


def test_a_nan_fault_leaves_the_controllers_own_command_unchanged() -> None:
    one, motors = lock_step("nan@1"), HOLD._replace(q=POSE_RAD.copy())
    answer(one, motors)
    assert one.robot.refusals.beyond_limits == 1
    assert np.isfinite(motors.q).all()


def test_faults_of_states_do_not_change_the_robots_motion() -> None:
    faulty = lock_step("state-delay=20:1", "state-nan:0.2", "state-reorder:0.2")
    assert run(faulty, 50)["motion"] == run(lock_step(), 50)["motion"]


def test_an_older_state_that_arrives_later_does_not_replace_a_newer_one() -> None:
    one = lock_step("state-duplicate:1")
    ticks = []
    for _ in range(5):
        answer(one)
        ticks.append(decode_state(one.published().state)[0])
    assert ticks == [10, 15, 20, 25, 30]


def test_a_state_carries_the_obeyed_writer_and_the_tick_to_answer() -> None:
    one = lock_step("state-mute@2")
    assert turn_of(one.published().state) == Turn(5, 0)
    command = encode_command(Command(5, HOLD))
    one.take_answer(command, writer=2**40 + 7)
    assert decode_state(one.published().state)[0] == 5
    assert turn_of(one.published().state) == Turn(10, 2**40 + 7)


def test_a_robot_that_stops_is_silent() -> None:
    one = lock_step("stop@3")
    run(one, 10)
    assert one.silent
    assert one.robot.steps == 3


def test_a_restarted_robot_repeats_its_motion_for_the_next_controller() -> None:
    one = lock_step("loss:0.2", "stop@90")
    motion = run(one, 80)["motion"]
    run(one, 20)
    assert one.silent
    one.restart()
    assert not one.silent
    assert run(one, 80)["motion"] == motion


def test_a_restart_fault_takes_the_robot_back_to_its_first_tick() -> None:
    one = lock_step("restart@3")
    assert [answer(one) for _ in range(3)] == [True] * 3
    assert one.robot.tick == 5


def test_a_restart_in_every_step_still_leaves_a_step_that_shows_it() -> None:
    one = lock_step("restart:1")
    assert [(answer(one), one.robot.tick)[1] for _ in range(4)] == [10, 5, 10, 5]


def test_the_run_of_a_restarted_robot_lasts_until_its_controller_leaves() -> None:
    one = lock_step("loss:0.2", "restart@50")
    motion = run(one, 49)["motion"]
    assert not one.is_left([1])
    answer(one)
    assert (one.robot.controller, one.is_left([1, 2]), one.is_left([2])) == (0, False, True)
    one.restart()
    assert not one.is_left([2])
    assert run(one, 49)["motion"] == motion
