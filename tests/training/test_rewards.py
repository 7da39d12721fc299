from dataclasses import replace
from operator import attrgetter
from types import SimpleNamespace

import numpy as np
import pytest

from spikeport.robot.description import JOINTS
from spikeport.robot.link.h1 import SPEED_LIMITS_RAD_S
from spikeport.robot.walk_interface import POSE_RAD
from spikeport.training import rewards
from spikeport.training.rewards import RewardScales, Step, Weights

SCALES = RewardScales(vx_sd_m_s=0.5, wz_sd_rad_s=0.25, drift_m_s=0.1, step_s=0.4, lift_m=0.1)


@pytest.fixture
def standing():
    """Return a step of a robot that stands upright while it is asked to walk."""
    motion = SimpleNamespace(
        gravity=np.array([[0.0, 0.0, -1.0]]),
        turn_rate=np.zeros((1, 3)),
        level_velocity=np.zeros((1, 3)),
        q=POSE_RAD[None].copy(),
        dq=np.zeros((1, 19)),
    )
    feet = SimpleNamespace(
        contact=np.array([[True, True]]),
        force_n=np.full((1, 2), 250.0),
        height_m=np.zeros((1, 2)),
        velocity=np.zeros((1, 2, 3)),
    )
    gait = SimpleNamespace(
        air_s=np.zeros((1, 2)),
        contact_s=np.ones((1, 2)),
        since_lift_s=np.zeros((1, 2)),
        touched_down=np.zeros((1, 2), bool),
        last_air_s=np.zeros((1, 2)),
        lifted=np.zeros((1, 2), bool),
        both_s=np.zeros(1),
    )
    newest, last, oldest, acceleration, torque = np.zeros((5, 1, 19))
    return Step(
        motion=motion,
        feet=feet,
        feet_before=SimpleNamespace(velocity=np.zeros((1, 2, 3))),
        pelvis_m=np.array([1.0]),
        even=np.array([True]),
        gait=gait,
        command=np.array([[0.5, 0.0, 0.25]]),
        moving=np.array([True]),
        moving_s=np.array([2.5]),
        velocity=np.zeros((1, 2)),
        yaw_rate=np.zeros(1),
        drift=np.array([[0.06, 0.08, 0.0]]),
        actions=(newest, last, oldest),
        joint_acceleration=acceleration,
        torque_nm=torque,
        fallen=np.array([False]),
        scales=SCALES,
    )


def swinging(step, height_m=0.05, air_s=0.3):
    """Lift the left foot in a step, and return the step."""
    step.feet.contact[0, 0] = False
    step.feet.height_m[0, 0] = height_m
    step.gait.air_s[0, 0], step.gait.contact_s[0, 0] = air_s, 0
    return step


def value(term, step):
    return getattr(rewards, term)(step)[0]


def test_every_weight_has_a_term():
    assert list(rewards.TERMS) == list(vars(Weights()))


def test_standing_still_costs_nothing_but_missed_speed(standing):
    costs = {name: term(standing)[0] for name, term in rewards.TERMS.items()}
    assert costs.pop("alive") == 1
    assert costs.pop("track_velocity") == pytest.approx(np.exp(-1))
    assert costs.pop("track_yaw_rate") == pytest.approx(np.exp(-1))
    assert costs.pop("on_average") == pytest.approx(np.exp(-1))
    assert set(costs.values()) == {0}


def test_setting_off_is_rewarded_most_without_drift_to_a_side(standing):
    swerving = replace(standing, moving_s=np.array([1.0]), drift=np.array([[0.3, 0.05, 0.0]]))
    assert value("set_off", swerving) == pytest.approx(np.exp(-1))
    assert value("set_off", replace(swerving, drift=np.array([[0.3, 0.0, 0.0]]))) == 1
    assert value("set_off", replace(swerving, moving=np.array([False]))) == 0


def test_lift_grows_with_the_height_of_the_swinging_foot(standing):
    assert value("lift", swinging(standing)) == pytest.approx(0.5)
    assert value("lift", swinging(standing, height_m=0.3)) == 1
    assert value("lift", replace(standing, moving=np.array([False]))) == 0


def test_time_in_the_air_counts_up_to_the_length_of_a_step(standing):
    assert value("air_time", swinging(standing)) == pytest.approx(0.3)
    assert value("air_time", swinging(standing, air_s=0.6)) == pytest.approx(0.4)


def test_a_foot_that_came_down_early_costs_the_missing_time(standing):
    standing.gait.touched_down[0, 1] = True
    standing.gait.last_air_s[0, 1] = 0.3
    assert value("early_touchdown", standing) == pytest.approx(0.1 / 0.02)


def test_a_foot_that_is_not_lifted_for_long_costs(standing):
    standing.gait.since_lift_s[0] = 1.0, 5.0
    assert value("late_lift", standing) == pytest.approx(0.2 + 1)


def test_a_low_foot_that_moves_costs(standing):
    standing.feet.velocity[0, 0, 0] = 2.0
    assert value("clearance", swinging(standing)) == pytest.approx(0.03**2 * 2)
    assert value("slide", standing) == 0
    standing.feet.contact[0, 0] = True
    assert value("slide", standing) == 2


FLIGHT = {"feet.contact": [False, False], "feet.height_m": [0.05, 0.05]}


@pytest.mark.parametrize(
    ("term", "changes", "expected"),
    [
        ("fall", {"fallen": [True]}, 1),
        ("alive", {"fallen": [True]}, 0),
        ("long_air", {"gait.air_s": [0.5, 0.6]}, 1),  # longer than 0.55 s
        ("long_air", {"gait.air_s": [0.5, 0.5]}, 0),
        ("high_foot", {"feet.height_m": [0.10, 0.20]}, 0.04),  # 4 cm beyond 16 cm
        ("flight", {"feet.contact": [False, True]}, 0),
        ("flight", FLIGHT, 1),
        # Only a robot on one foot gains by a step.
        ("lift", FLIGHT, 0),
        ("air_time", {"feet.contact": [False, False], "gait.air_s": [0.3, 0.2]}, 0),
        ("impact", {"feet.force_n": [800.0, 500.0]}, 100),  # beyond 700 N
        ("impact", {"feet.force_n": [9000.0, 800.0]}, 1100),  # up to 1,000 N, and 100 N
        ("low_pelvis", {"pelvis_m": [0.9]}, 0.05),  # below 0.95 m
        ("tilt", {"motion.gravity": [0.1, 0.2, -0.9]}, 0.05),  # 0.01 + 0.04
        ("sway", {"motion.turn_rate": [0.1, 0.2, 0.7]}, 0.05),  # a turn about z is no sway
        ("bounce", {"motion.level_velocity": [0.5, 0.4, -0.3]}, 0.09),
        ("acceleration", {"joint_acceleration": [3.0, -4.0]}, 25),  # 9 + 16
        ("torque", {"torque_nm": [3.0, -4.0]}, 25),
    ],
)
def test_a_changed_step_has_the_value_worked_out_by_hand(standing, term, changes, expected):
    for part, values in changes.items():
        np.atleast_2d(attrgetter(part)(standing))[0, : len(values)] = values
    assert value(term, standing) == pytest.approx(expected)


def test_a_robot_asked_to_stand_gains_by_keeping_both_feet_on_the_floor(standing):
    still = replace(standing, moving=np.array([False]))
    assert value("stand", standing) == 0
    assert value("stand", still) == 1
    assert value("restless", swinging(standing)) == 0
    assert value("restless", swinging(still)) == pytest.approx(0.05)
    assert value("stand", still) == 0


def test_a_robot_asked_to_stand_on_uneven_ground_may_step(standing):
    rough = replace(standing, moving=np.array([False]), even=np.array([False]))
    assert value("stand", rough) == 0
    assert value("restless", swinging(rough)) == 0


TERMS_OF_JOINTS = {
    "hip_yaw": "hips",
    "hip_roll": "hips",
    "torso": "torso",
    "shoulder_pitch": "swinging_arms",
    "elbow": "swinging_arms",
    "shoulder_roll": "spread_arms",
    "shoulder_yaw": "spread_arms",
}


@pytest.mark.parametrize("turn_rad", [0.2, -0.3])
@pytest.mark.parametrize("joint", JOINTS)
def test_a_joint_turned_from_the_default_pose_costs_the_angle_in_its_term_alone(
    standing, joint, turn_rad
):
    standing.motion.q[0, JOINTS.index(joint)] += turn_rad
    own = TERMS_OF_JOINTS.get(joint.removeprefix("left_").removeprefix("right_"))
    costs = {term: value(term, standing) for term in set(TERMS_OF_JOINTS.values())}
    assert costs == pytest.approx({term: abs(turn_rad) * (term == own) for term in costs})


@pytest.mark.parametrize("ankle_rad", [-0.85, 0.5])
def test_an_ankle_near_its_stops_costs_its_excess(standing, ankle_rad):
    standing.motion.q[0, JOINTS.index("left_ankle")] = ankle_rad  # from -0.8 to 0.45 is free
    assert value("ankle_limits", standing) == pytest.approx(0.05)


def test_action_rate_and_jerk_are_squared_differences_of_actions(standing):
    newest, last, oldest = np.full((3, 1, 19), 0.0)
    newest[0, 0], last[0, 0] = 3.0, 1.0
    step = replace(standing, actions=(newest, last, oldest))
    assert value("action_rate", step) == 4
    assert value("action_jerk", step) == 1


def test_rewards_are_per_second(standing):
    terms = rewards.reward(standing, Weights(alive=0.25, track_velocity=0.0))
    assert terms["alive"] == pytest.approx(0.25 * 0.02)
    assert "track_velocity" not in terms


def test_a_foot_that_is_lifted_as_the_other_comes_down_costs(standing):
    standing.gait.lifted[0, 1], standing.gait.both_s[0] = True, 0.02
    missing_s = SCALES.double_support_s - 0.02
    assert rewards.hasty_lift(standing)[0] == pytest.approx(missing_s / 0.02)
    standing.gait.both_s[0] = 0.3
    assert rewards.hasty_lift(standing)[0] == 0


def test_a_foot_that_comes_down_fast_costs(standing):
    standing.gait.touched_down[0, 0] = True
    standing.feet_before.velocity[0, :, 2] = -0.5, -2.0
    assert rewards.hard_touchdown(standing)[0] == pytest.approx(0.25 / 0.02)


def test_leg_joints_cost_beyond_80_percent_of_their_motors_speed(standing):
    knee, elbow = JOINTS.index("left_knee"), JOINTS.index("left_elbow")
    standing.motion.dq[0, elbow] = 30.0
    standing.motion.dq[0, knee] = -0.8 * SPEED_LIMITS_RAD_S[knee]
    assert rewards.fast_joints(standing)[0] == 0
    standing.motion.dq[0, knee] -= 2.0
    assert rewards.fast_joints(standing)[0] == pytest.approx(4.0)
