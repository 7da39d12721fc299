from dataclasses import replace

import numpy as np
import pytest

from spikeport.angles import wrap
from spikeport.robot import mirror
from spikeport.robot.description import JOINTS
from spikeport.robot.walk_interface import PARTS, POSE_RAD
from spikeport.training import randomisation
from spikeport.training.commands import CommandRange
from spikeport.training.environment import EPISODE_STEPS, TrainingTask, WalkEnvironment
from spikeport.training.model import floor_pairs
from spikeport.training.observation import PRIVILEGED
from spikeport.training.rewards import Weights
from spikeport.training.terrain import Terrain
from spikeport.training.velocity_belief import EstimatorErrors

CALM = TrainingTask(randomisation=randomisation.UNDISTURBED)
STATE = mirror.joined(
    mirror.SCALAR,
    mirror.VECTOR,
    mirror.Mirror(np.arange(4), np.array([1.0, -1.0, 1.0, -1.0])),
    mirror.JOINT,
    mirror.VECTOR,
    mirror.AXIAL,
    mirror.JOINT,
)
ARMS = np.array(
    [
        joint.endswith(("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow"))
        for joint in JOINTS
    ]
)
FORWARD = 1.0 * np.isin(np.arange(19), [2, 7])
"""Hip pitch of both legs."""


@pytest.fixture
def environment():
    made = []

    def make(n=4, task=CALM, seed=0):
        made.append(WalkEnvironment(n, task, seed, threads=1))
        return made[-1]

    yield make
    for env in made:
        env.close()


def run(env, steps, seed=1):
    """Return the observations and rewards of random actions."""
    rng = np.random.default_rng(seed)
    seen, rewards = [], []
    for _ in range(steps):
        outcome = env.step(0.3 * rng.standard_normal((env.n, 19)))
        seen.append(env.observe())
        rewards.append(outcome.reward)
    return np.array(seen), np.array(rewards)


def test_the_same_seed_gives_the_same_run(environment):
    seen, rewards = run(environment(task=TrainingTask(), seed=5), 40)
    again, rewards_again = run(environment(task=TrainingTask(), seed=5), 40)
    assert (seen == again).all()
    assert (rewards == rewards_again).all()
    other, _ = run(environment(task=TrainingTask(), seed=6), 40)
    assert (seen != other).any()


def test_a_mirrored_run_has_equal_rewards_and_mirrored_observations(environment):
    task = replace(CALM, commands=CommandRange(heading=0.0))
    left, right = environment(n=3, task=task), environment(n=3, task=task)
    right.states[:] = STATE(left.states)
    right.commands.wanted[:] = mirror.COMMAND(left.commands.wanted)
    left.step(np.zeros((3, 19)))
    right.step(np.zeros((3, 19)))
    rng = np.random.default_rng(0)
    for _ in range(3):
        action = 0.3 * rng.standard_normal((3, 19))
        one, other = left.step(action), right.step(mirror.JOINT(action))
        np.testing.assert_allclose(one.reward, other.reward, atol=1e-3)
    np.testing.assert_allclose(
        PRIVILEGED(left.observe_all()), right.observe_all(), atol=2e-2, rtol=2e-2
    )


def test_a_robot_without_a_policy_falls_and_starts_over(environment):
    env = environment(n=2, task=replace(CALM, weights=Weights(fall=-100.0)))
    outcome = env.step(np.tile(FORWARD, (2, 1)))
    assert not outcome.fallen.any()
    while not outcome.fallen.any():
        outcome = env.step(np.tile(FORWARD, (2, 1)))
    first = np.argmax(outcome.fallen)
    assert outcome.terms["fall"][first] == pytest.approx(-2.0)
    assert env.age[first] == 0
    np.testing.assert_allclose(env.motion.q[first], POSE_RAD, atol=0.05)
    assert (env.observe()[first, PARTS["last action"]] == 0).all()


def test_an_episode_ends_after_20_s(environment):
    env = environment(n=2)
    env.age[:] = EPISODE_STEPS - 1, 3
    outcome = env.step(np.zeros((2, 19)))
    assert outcome.timed_out.tolist() == [True, False]
    assert not outcome.fallen.any()
    assert env.age.tolist() == [0, 4]


def test_episodes_begin_at_ages_that_are_spread_and_depend_on_the_seed(environment):
    def ages(seed):
        env = environment(n=20, seed=seed)
        env.spread_ages()
        return env.age

    found = ages(5)
    assert found.shape == (20,)
    assert 0 <= found.min() < EPISODE_STEPS / 4
    assert EPISODE_STEPS / 2 < found.max() < EPISODE_STEPS
    assert len(set(found.tolist())) > 10
    assert (found == ages(5)).all()
    assert (found != ages(6)).any()


def test_a_robot_that_diverges_counts_as_fallen(environment):
    env = environment(n=2)
    env.states[0, 40] = 1e12
    outcome = env.step(np.zeros((2, 19)))
    assert outcome.fallen.tolist() == [True, False]
    assert np.isfinite(outcome.reward).all()
    assert np.isfinite(env.observe_all()).all()


def test_a_delayed_action_acts_later(environment):
    def moved(delay_steps):
        delays = replace(randomisation.UNDISTURBED, delay_steps=(delay_steps, delay_steps))
        env = environment(n=1, task=replace(CALM, randomisation=delays))
        still, pushed = env.states.copy(), np.zeros((1, 19))
        pushed[0, 10] = 1.0
        env.step(np.zeros((1, 19)))
        rest = env.motion.q[0, 10]
        env.states[:] = still
        env.step(pushed)
        return env.motion.q[0, 10] - rest

    distances = [moved(d) for d in range(5)]
    assert distances[0] > distances[1] > distances[2] > distances[3] > 0
    assert distances[4] == pytest.approx(0, abs=1e-3)


def test_pushes_change_the_velocity(environment):
    pushing = replace(randomisation.UNDISTURBED, push_m_s=0.5, push_every_s=0.02)
    env = environment(n=50, task=replace(CALM, randomisation=pushing))
    env.step(np.zeros((50, 19)))
    speed = np.abs(env.motion.level_velocity[:, :2])
    assert 0.2 < speed.mean() < 0.35


def test_the_drift_averages_the_error_of_commands_until_a_fall(environment):
    commands = CommandRange(vx_m_s=(0.5, 0.5), wz_rad_s=0.0, heading=0.0, jumping=1.0)
    env = environment(n=2, task=replace(CALM, commands=commands))
    average = np.zeros((2, 3))
    for _ in range(25):
        command = env.commands.value.copy()
        env.step(np.zeros((2, 19)))
        speed = np.column_stack((env.motion.level_velocity[:, :2], env.motion.yaw_rate))
        average = 0.96 * average + 0.04 * (command - speed)
    np.testing.assert_allclose(env.drift, average, atol=1e-12)
    assert (env.drift[:, 0] > 0.1).all()
    env.states[0, 3] = 0.3
    env.step(np.zeros((2, 19)))
    assert not env.drift[0].any()
    assert env.drift[1].any()


def test_a_joint_offset_is_kept_for_an_episode(environment):
    task = replace(CALM, randomisation=replace(randomisation.UNDISTURBED, joint_offset_sd_rad=0.1))
    env = environment(n=200, task=task)
    offset = env.joint_offset.copy()
    assert offset.std() == pytest.approx(0.1, abs=0.01)
    env.step(np.zeros((200, 19)))
    assert (env.joint_offset == offset).all()


def test_bodies_differ_within_their_ranges(environment):
    env = environment(n=30, task=TrainingTask())
    floor = floor_pairs(env._models[0])[0]
    friction = [m.pair_friction[floor, 0] for m in env._models]
    assert 0.5 <= min(friction) < 0.7
    assert 1.0 < max(friction) <= 1.2
    masses = [m.body("torso_link").mass[0] for m in env._models]
    assert 17.789 - 2 <= min(masses) < max(masses) <= 17.789 + 2


def test_an_episode_begins_with_a_foot_on_the_floor(environment):
    rough = Terrain(rough=1.0, slope_rad=0.1, relief_m=0.02, box_m=0.03)
    env = environment(
        n=8, task=replace(CALM, randomisation=replace(CALM.randomisation, terrain=rough))
    )
    np.testing.assert_allclose(env.feet.height_m.min(axis=1), 0.0, atol=1e-9)
    standing_feet(env, steps=30)
    assert env.feet.contact.all()
    env.age[1] = EPISODE_STEPS - 1
    env.step(np.zeros((8, 19)))
    assert env.age[1] == 0
    assert env.feet.height_m[1].min() == pytest.approx(0.0, abs=1e-9)
    along = (env.feet.points[1, :, 1] - env.feet.points[1, :, 0]).mean(axis=0)
    assert abs(wrap(np.arctan2(along[1], along[0]) - env.motion.heading_rad[1])) < 0.15


def test_a_push_shows_in_leg_odometry_a_step_later(environment):
    odometry = replace(randomisation.UNDISTURBED, estimator=EstimatorErrors(odometry=1.0))
    still, pushed = (
        environment(n=20, task=replace(CALM, randomisation=replace(odometry, push_m_s=push)))
        for push in (0.0, 2.0)
    )
    pushed.task = replace(
        pushed.task, randomisation=replace(pushed.task.randomisation, push_every_s=0.02)
    )
    for env in (still, pushed):
        env.step(np.zeros((20, 19)))
    assert np.abs(pushed.motion.velocity - still.motion.velocity).max() > 0.5
    np.testing.assert_array_equal(pushed.estimated_velocity, still.estimated_velocity)
    for env in (still, pushed):
        env.step(np.zeros((20, 19)))
    assert np.abs(pushed.estimated_velocity - still.estimated_velocity).max() > 0.2


def test_torques_are_those_of_targets_that_have_arrived(environment):
    def torque_cost(delay_steps):
        late = replace(randomisation.UNDISTURBED, delay_steps=(delay_steps, delay_steps))
        env = environment(n=1, task=replace(CALM, randomisation=late))
        outcome = env.step(np.eye(19)[10:11])
        return -outcome.terms["torque"][0]

    assert torque_cost(0) > 10 * torque_cost(4)


def test_commands_are_those_of_the_task(environment):
    env = environment(n=20, task=replace(CALM, commands=CommandRange(standing=1.0)))
    assert not env.commands.moving.any()
    assert (env.observe()[:, PARTS["command"]] == 0).all()


def test_an_arm_may_be_busy_while_the_robot_stands(environment):
    randomised = replace(randomisation.UNDISTURBED, busy_arms=1.0)
    env = environment(n=20, task=TrainingTask(CommandRange(standing=1.0), randomised))
    for _ in range(40):
        env.step(np.zeros((20, 19)))
    away = np.abs(env._targets - POSE_RAD) > 0
    assert away.any()
    assert not away[:, ~ARMS].any()


def standing_feet(env, steps=60):
    """Let the robots stand for some steps, and return their feet."""
    for _ in range(steps):
        env.step(np.zeros((env.n, 19)))
    return env.feet


def test_feet_touch_the_ground_of_their_robot(environment):
    """A foot that is lifted comes down on the plane that was laid below it meanwhile."""
    rough = Terrain(rough=1.0, slope_rad=0.1, relief_m=0.02, box_m=0.03)
    env = environment(
        n=8, task=replace(CALM, randomisation=replace(CALM.randomisation, terrain=rough))
    )
    rng, lowest = np.random.default_rng(0), []
    for _ in range(40):
        env.step(0.5 * rng.standard_normal((8, 19)))
        pressed = env.feet.contact & (env.age > 10)[:, None]
        lowest.append(env.feet.height_m[pressed])
    lowest = np.concatenate(lowest)
    assert len(lowest) > 50
    assert np.abs(env.feet.ground_m).max() > 0.005
    assert -0.04 < np.median(lowest) < 0.02


def test_level_ground_is_at_zero(environment):
    env = environment(n=3)
    feet = standing_feet(env, 5)
    assert not feet.ground_m.any()
    np.testing.assert_allclose(env.pelvis_m, env.motion.height_m)
