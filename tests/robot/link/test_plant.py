"""A plant over messages, which moves as its robot does and sends the commands that are set."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from spikeport.errors import RobotLostError
from spikeport.robot.description import ARM_JOINTS, GAINS, JOINTS
from spikeport.robot.engine import mujoco
from spikeport.robot.estimator.base import Fix
from spikeport.robot.estimator.registry import EKF, LEG_ODOMETRY, TRUTH
from spikeport.robot.feet import Feet
from spikeport.robot.link.client import InlineRobot, Observed
from spikeport.robot.link.codec import Base
from spikeport.robot.link.faults import FAULTS
from spikeport.robot.link.lock_step import LockStep
from spikeport.robot.link.motion import EstimatedMotion
from spikeport.robot.link.plant import LinkedPlant
from spikeport.robot.link.robot import SimulatedRobot
from spikeport.robot.link.settings import RobotSettings
from spikeport.robot.plant import Plant
from spikeport.robot.signals import MotorCommands


class Recorded(InlineRobot):
    """A robot that records its commands, and whether it was closed."""

    def __init__(self, settings: RobotSettings, *faults: str) -> None:
        self.settings = settings
        self.robot = SimulatedRobot(settings)
        super().__init__(LockStep(self.robot, [FAULTS.parse(text) for text in faults]))
        self.commands: list[MotorCommands] = []
        self.closed = False

    def exchange(self, last: Observed, motors: MotorCommands) -> Observed:
        self.commands.append(motors)
        return super().exchange(last, motors)

    def close(self) -> None:
        self.closed = True


def linked(*faults: str, anchored: bool = True) -> tuple[LinkedPlant, list[Recorded]]:
    made: list[Recorded] = []

    def connect(settings: RobotSettings) -> Recorded:
        made.append(Recorded(settings, *faults))
        return made[-1]

    return LinkedPlant(connect, partial(EstimatedMotion, TRUTH), anchored=anchored), made


def test_the_plant_has_the_positions_and_velocities_of_its_robot() -> None:
    plant, made = linked(anchored=False)
    plant.reset(3)
    for _ in range(40):
        plant.step()
    robot = made[0].robot
    assert plant.time_s == pytest.approx(0.2)
    np.testing.assert_allclose(plant.data.qpos, robot._plant.data.qpos, atol=1e-6)
    np.testing.assert_allclose(plant.data.qvel, robot._plant.data.qvel, atol=1e-4)
    hand = plant.data.site("right_hand").xpos
    np.testing.assert_allclose(hand, _hand_of(robot._plant), atol=1e-6)
    assert len(plant.history()["time_s"]) == 41


def _hand_of(plant: Plant) -> np.ndarray:
    """Return the place of the right hand at the present state, not at the step before."""
    mujoco.mj_kinematics(plant.model, plant.data)
    return np.array(plant.data.site("right_hand").xpos)


@pytest.mark.parametrize("anchored", [True, False])
def test_the_estimator_of_a_hung_robot_gets_the_place_of_its_hoist(anchored: bool) -> None:
    fixes: list[Fix | None] = []

    def estimator(held: Fix | None) -> EstimatedMotion:
        fixes.append(held)
        return EstimatedMotion(TRUTH, held)

    plant = LinkedPlant(Recorded, estimator, anchored=anchored)
    plant.reset(3)
    (held,) = fixes
    if not anchored:
        assert held is None
        return
    assert held is not None
    np.testing.assert_allclose(held.position, plant.data.qpos[:3], atol=1e-6)
    assert held.yaw_rad == 0.0


def test_controllers_get_the_estimate_and_the_truth_is_recorded() -> None:
    made: list[Recorded] = []

    def connect(settings: RobotSettings) -> Recorded:
        made.append(Recorded(settings))
        return made[-1]

    plant = LinkedPlant(connect, partial(EstimatedMotion, LEG_ODOMETRY))
    plant.reset(3)
    for _ in range(100):
        plant.step()
    true = made[0].robot._plant
    np.testing.assert_allclose(plant.true_in_plane, true.true_in_plane, atol=1e-5)
    assert plant.height_m == pytest.approx(true.height_m, abs=1e-5)
    np.testing.assert_array_equal(plant.in_plane[1:3], plant.state.base_position[:2])
    assert np.abs(plant.in_plane - plant.true_in_plane).max() > 1e-3


@pytest.mark.parametrize("name", [EKF, LEG_ODOMETRY, TRUTH])
def test_recordings_get_the_true_contacts_and_tilt(name: str) -> None:
    made: list[Recorded] = []

    def connect(settings: RobotSettings) -> Recorded:
        made.append(Recorded(settings))
        return made[-1]

    plant = LinkedPlant(connect, partial(EstimatedMotion, name))
    feet, on_floor = Feet(plant.model), []
    plant.reset(3)
    robot = made[0].robot._plant
    for _ in range(100):
        plant.step()
        mujoco.mj_fwdPosition(robot.model, robot.data)  # contacts of the present state
        on_floor.append(feet.on_floor(plant.true_data))
        np.testing.assert_array_equal(on_floor[-1], feet.on_floor(robot.data))
        np.testing.assert_allclose(plant.true_data.qpos, robot.data.qpos, atol=1e-6)
        np.testing.assert_allclose(plant.true_data.qvel[3:6], robot.data.qvel[3:6], atol=1e-5)
    assert np.any(on_floor)


def moved(settings: RobotSettings) -> Recorded:
    """Return a robot that has walked on before the run."""
    made = Recorded(settings)
    data = made.robot._plant.data
    data.qpos[:2] = 4.0, -2.0
    data.qpos[3:7] = np.cos(1.5), 0, 0, np.sin(1.5)
    mujoco.mj_forward(made.robot._plant.model, data)
    # The first observation was made before.
    made._robot = LockStep(made.robot)
    return made


@pytest.mark.parametrize(
    ("connect", "name", "start"),
    [
        (moved, TRUTH, [3.0, 4.0, -2.0]),
        (moved, EKF, [3.0, 0.0, 0.0]),
        (Recorded, TRUTH, [0.0, 0.0, 0.0]),
        (Recorded, EKF, [0.0, 0.0, 0.0]),
    ],
)
def test_a_run_starts_where_the_estimator_finds_the_robot(
    connect: Callable[[RobotSettings], Recorded], name: str, start: list[float]
) -> None:
    plant = LinkedPlant(connect, partial(EstimatedMotion, name))
    plant.reset(3)
    np.testing.assert_allclose(plant.start, start, atol=1e-6)
    # A robot made for the run starts at the origin, without the rounding of its messages.
    assert connect is moved or not plant.start.any()


class OfSportMode(Recorded):
    """A robot whose sport mode left a message on the topic of a simulation's truth."""

    def _follow(self, last: Observed, found: Observed) -> Observed:
        stale = Base(0, np.array([5.0, 0.0, 0.0]), np.zeros(3))
        return super()._follow(last, found)._replace(truth=stale)


def test_the_estimate_is_recorded_if_the_truth_is_not_of_this_robot() -> None:
    plant = LinkedPlant(OfSportMode, partial(EstimatedMotion, LEG_ODOMETRY))
    plant.reset(3)
    for _ in range(20):
        plant.step()
    np.testing.assert_array_equal(plant.true_in_plane, plant.in_plane)
    assert plant.height_m == plant.data.qpos[2]


def test_a_linked_plant_moves_nearly_as_a_plant_without_messages() -> None:
    plant, alone = linked()[0], Plant(anchored=True)
    for one in (plant, alone):
        one.reset(5)
        one.hold(("right_elbow",), 1.0)
        one.torque(("left_elbow",), 2.0)
        for _ in range(100):
            one.step()
    np.testing.assert_allclose(plant.data.qpos, alone.data.qpos, atol=2e-3)


def test_a_reset_connects_a_robot_of_the_seed_and_posture() -> None:
    plant, made = linked()
    assert made == []
    assert not plant.has_own_clock
    plant.reset(7, posture_rad={"right_elbow": 1.0})
    assert made[0].settings.seed == 7
    assert made[0].settings.hoist
    assert made[0].settings.rate_hz == 200
    assert dict(made[0].settings.posture_rad) == {"right_elbow": 1.0}
    plant.reset(8)
    assert made[0].closed
    assert not made[1].closed
    assert plant.has_own_clock
    plant.close()
    assert made[1].closed
    assert not plant.has_own_clock
    assert plant.link is not None


def test_targets_gains_and_torques_are_commanded_as_they_were_set() -> None:
    plant, made = linked()
    plant.reset(0)
    arm = [JOINTS.index(joint) for joint in ARM_JOINTS]
    plant.torque(ARM_JOINTS, [1.0, -2.0, 3.0, -4.0])
    plant.hold(("torso",), 0.25)
    plant.step()
    sent, torso = made[0].commands[-1], JOINTS.index("torso")
    np.testing.assert_array_equal(sent.tau[arm], [1, -2, 3, -4])
    np.testing.assert_array_equal((sent.kp[arm], sent.kd[arm], sent.q[arm]), np.zeros((3, 4)))
    assert (sent.q[torso], sent.kp[torso], sent.kd[torso]) == (0.25, *GAINS["torso"])
    assert sent.tau[torso] == 0
    plant.damp()
    plant.step()
    damped = made[0].commands[-1]
    np.testing.assert_array_equal(damped.kd, np.full(19, 8.0))
    for values in (damped.q, damped.dq, damped.kp, damped.tau):
        np.testing.assert_array_equal(values, np.zeros(19))


@pytest.mark.parametrize(
    ("fault", "words"),
    [("stop@3", "sent no state after that of 15 ms"), ("restart@3", "began anew")],
)
def test_a_robot_that_stops_or_restarts_ends_the_run(fault: str, words: str) -> None:
    plant, _ = linked(fault)
    plant.reset(0)
    plant.step()
    plant.step()
    with pytest.raises(RobotLostError, match=words):
        plant.step()
