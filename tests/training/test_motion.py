import numpy as np

from spikeport.robot import state
from spikeport.robot.foot_sensors import SENSORS
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import observation
from spikeport.training.model import TOE_RADIUS_M
from spikeport.training.motion import FeetMotion, Motion


def fallen_a_little():
    plant = Plant()
    plant.reset(3)
    plant.data.qvel[:6] = [0.4, -0.2, 0.1, 0.5, -0.6, 0.7]
    for _ in range(20):
        plant.step()
    return plant


def test_the_motion_in_a_batch_equals_that_of_a_single_robot():
    plant = fallen_a_little()
    motion = Motion.from_states(plant.data.qpos[None], plant.data.qvel[None])
    one = state.read(plant.data)
    np.testing.assert_allclose(motion.velocity[0], one.base_linear_velocity, atol=1e-12)
    np.testing.assert_allclose(motion.turn_rate[0], one.base_angular_velocity)
    np.testing.assert_allclose(motion.q[0], one.q)
    seen = observation(one, np.zeros(3), np.zeros(19))
    np.testing.assert_allclose(motion.gravity[0], seen[6:9])


def test_the_level_frame_turns_about_the_vertical_alone():
    plant = fallen_a_little()
    motion = Motion.from_states(plant.data.qpos[None], plant.data.qvel[None])
    rotation = plant.data.body("pelvis").xmat.reshape(3, 3)
    assert motion.level_velocity[0, 2] == plant.data.qvel[2]
    np.testing.assert_allclose(motion.yaw_rate[0], (rotation @ plant.data.qvel[3:6])[2])
    forward = np.array([np.cos(motion.heading_rad[0]), np.sin(motion.heading_rad[0])])
    np.testing.assert_allclose(motion.level_velocity[0, 0], forward @ plant.data.qvel[:2])


def test_the_motion_of_the_feet_is_computed_from_their_sensors():
    sensors = np.zeros((1, 2, sum(SENSORS.values())))
    sensors[0, :, 3] = 0.2  # the toes are ahead of the heels
    sensors[0, 0, [2, 5]] = 0.12, 0.055  # heights of left heel and toe
    sensors[0, 0, 6:9], sensors[0, 0, 9:12] = (1, 2, 3), (3, 2, 1)
    sensors[0, 1, [2, 5]] = 0.1, 0.1
    sensors[0, 1, 13:16] = 0, 30, -40
    feet = FeetMotion.from_sensors(sensors.reshape(1, -1), lambda xy: np.full(xy.shape[:2], 0.02))
    np.testing.assert_allclose(feet.clearance_m[0, 0], [0.08, 0.02])
    np.testing.assert_allclose(feet.height_m, [[0.02, 0.06]])
    np.testing.assert_allclose(feet.velocity[0, 0], [2, 2, 2])
    np.testing.assert_allclose(feet.force_n, [[0, 50]])
    assert feet.contact.tolist() == [[False, True]]


def test_the_lowest_points_of_a_rolling_foot_stand_still():
    # A foot that rolls over its toe, 15 mm below the toe's centre, at 2 rad/s about y.
    turn, touch, heel = np.array([0, 2.0, 0]), np.array([0.2, 0.1, 0]), np.array([0, 0.1, 0.08])
    toe = touch + np.array([0, 0, TOE_RADIUS_M])
    velocities = [np.cross(turn, point - touch) for point in (heel, toe)]
    right = [np.zeros(3), np.ones(3) * [0.2, 0, 1]]
    sensors = np.concatenate((heel, toe, *velocities, np.zeros(4), *right, np.zeros(10)))
    sensors[len(sensors) // 2 + 2] = 1.0  # the right foot is far above the floor
    feet = FeetMotion.from_sensors(sensors[None], lambda xy: np.zeros(xy.shape[:2]))
    assert np.abs(feet.velocity[0, 0]).max() > 0.05
    np.testing.assert_allclose(feet.lowest_velocity[0], 0, atol=1e-6)
