"""A robot on its hoist is let down slowly, stands held, and is let go of."""

import pytest

from spikeport.errors import UsageError
from spikeport.robot.link.codec import Command
from spikeport.robot.link.controller import HOLD
from spikeport.robot.link.hoist import LOWERS_M_S, Held, Hoist
from spikeport.robot.link.robot import LETS_GO_S, SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.plant import Plant


def test_a_robot_is_let_down_until_it_stands_and_then_let_go_of() -> None:
    plant = Plant(anchored=True)
    hoist, hung_m = Hoist(plant), plant.lowest_sole_m()
    for _ in range(10):
        hoist.step()
        plant.step()
    assert hoist.held is Held.HANGS
    hoist.pull()
    hoist.pull()  # nothing, as long as it is on its way
    steps = 0
    while hoist.held is Held.LOWERS:
        hoist.step()
        plant.step()
        steps += 1
    assert steps * plant.dt_s == pytest.approx(hung_m / LOWERS_M_S, abs=0.1)
    assert abs(plant.lowest_sole_m()) < 0.01
    assert plant.anchored
    hoist.pull()
    assert (hoist.held, plant.anchored) == (Held.FREE, False)
    hoist.pull()
    assert hoist.held is Held.FREE


def test_a_robot_without_a_hoist_is_free() -> None:
    assert Hoist(Plant()).held is Held.FREE


def test_time_pulls_the_hoist_twice() -> None:
    robot = SimulatedRobot(RobotSettings(hoist=True, let_down_s=0.5))
    held = []
    for _ in range(round((0.5 + LETS_GO_S) / 0.005) + 1):
        robot.obey(Command(robot.tick, HOLD))
        robot.step()
        if not held or held[-1][1] is not robot.hoist.held:
            held.append((robot.steps - 1, robot.hoist.held))
    assert [phase for _, phase in held] == list(Held)
    assert (held[1][0], held[3][0]) == (100, 900)
    robot.restart()
    assert robot.hoist.held is Held.HANGS


def test_only_a_robot_on_its_hoist_is_let_down() -> None:
    with pytest.raises(UsageError, match="--let-down is for a robot on its --hoist"):
        RobotSettings(let_down_s=1.0)
