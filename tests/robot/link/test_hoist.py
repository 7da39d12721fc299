"""The hoist: a robot that is lowered slowly, stands while it is held, and is released."""

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.robot.description import DEFAULT_POSE, JOINTS
from spikeport.robot.link.codec import Command, decode_base
from spikeport.robot.link.controller import HOLD
from spikeport.robot.link.hoist import LOWERS_M_S, Held, Hoist
from spikeport.robot.link.robot import LETS_GO_S, SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands

FOLDED = {
    f"{side}_{joint}": rad
    for side in ("left", "right")
    for joint, rad in (("knee", 1.6), ("hip_pitch", -0.8), ("ankle", -0.8))
}
"""A posture from which lowering takes longer than `LETS_GO_S`."""


def held(robot: SimulatedRobot, command: MotorCommands, steps: int) -> list[tuple[int, Held]]:
    """Return the phases of a commanded robot's hoist, each with the step at which it began."""
    found: list[tuple[int, Held]] = []
    for step in range(steps):
        robot.obey(Command(robot.tick, command))
        robot.step()
        if not found or found[-1][1] is not robot.hoist.held:
            found.append((step, robot.hoist.held))
    return found


def test_a_robot_is_lowered_until_it_stands_and_is_then_released() -> None:
    plant = Plant(anchored=True)
    hoist = Hoist(plant)
    for _ in range(200):
        hoist.step()
        plant.step()
    assert hoist.held is Held.HANGS
    hung_m = plant.lowest_sole_m()  # the weight of the legs has stretched them
    hoist.advance()
    hoist.advance()  # has no effect while the robot is being lowered
    steps = 0
    while hoist.held is Held.LOWERS:
        hoist.step()
        plant.step()
        steps += 1
    assert steps * plant.dt_s == pytest.approx(hung_m / LOWERS_M_S, abs=0.1)
    assert abs(plant.lowest_sole_m()) < 0.01
    assert plant.anchored
    hoist.advance()
    assert (hoist.held, plant.anchored) == (Held.FREE, False)
    hoist.advance()
    assert hoist.held is Held.FREE


def test_a_robot_without_a_hoist_is_free() -> None:
    assert Hoist(Plant()).held is Held.FREE


def test_the_hoist_lowers_and_releases_the_robot_at_set_times() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, let_down_s=0.5))
    found = held(robot, HOLD, round((0.5 + LETS_GO_S) / 0.005) + 1)
    assert [phase for _, phase in found] == list(Held)
    assert (found[1][0], found[3][0]) == (100, 900)
    robot.restart()
    assert robot.hoist.held is Held.HANGS


def test_a_robot_that_is_still_being_lowered_is_released_once_it_stands() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, let_down_s=0.0, posture_rad=FOLDED))
    folded = HOLD._replace(q=np.array([(DEFAULT_POSE | FOLDED)[joint] for joint in JOINTS]))
    found = held(robot, folded, round(6.0 / 0.005))
    assert [phase for _, phase in found] == [Held.LOWERS, Held.STANDS, Held.FREE]
    stands, free = found[1][0], found[2][0]
    assert free == stands + 1 > LETS_GO_S / 0.005


def test_a_robot_that_was_lowered_early_by_hand_is_released_at_the_set_time() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, let_down_s=0.5))
    robot.hoist.advance()
    found = held(robot, HOLD, round((0.5 + LETS_GO_S) / 0.005) + 1)
    assert [phase for _, phase in found] == [Held.LOWERS, Held.STANDS, Held.FREE]
    assert found[2][0] == 900


def test_a_robot_whose_legs_stretch_while_lowered_stands_where_they_touch_the_floor() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, let_down_s=0.0, posture_rad=FOLDED))
    held(robot, HOLD, round(3.5 / 0.005))
    assert robot.hoist.held is Held.STANDS
    assert decode_base(robot.truth()).position[2] == pytest.approx(0.98, abs=0.01)


def test_a_robot_whose_legs_bend_while_lowered_does_not_stand_in_the_air() -> None:
    plant = Plant(anchored=True)
    hoist, hung_m = Hoist(plant), plant.lowest_sole_m()
    hoist.advance()
    plant.hold(list(FOLDED), list(FOLDED.values()))
    steps = 0
    while hoist.held is Held.LOWERS:
        hoist.step()
        plant.step()
        steps += 1
    assert abs(plant.lowest_sole_m()) < 0.01
    assert steps * plant.dt_s > hung_m / LOWERS_M_S + 1.0


def test_lowering_a_robot_without_a_hoist_is_refused() -> None:
    with pytest.raises(UsageError, match="--let-down is for a robot on its --hoist"):
        RobotSettings(let_down_s=1.0)
