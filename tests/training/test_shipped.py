"""The walk of the shipped policy on the deployed robot."""

import numpy as np
import pytest

from spikeport.networks.walking_policy import SHIPPED, load
from spikeport.robot.description import JOINTS
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import CONTROL_DT_S, observation, targets_rad


@pytest.fixture(scope="module")
def policy():
    return load()


def walked(policy, vx_m_s, wz_rad_s, seconds=8.0):
    """Return forward speed, yaw rate, height of the pelvis and of the heels, each control step."""
    plant = Plant()
    plant.reset(0)
    action, rows = np.zeros(len(JOINTS)), []
    for _ in range(round(seconds / CONTROL_DT_S)):
        action = policy(observation(plant.state, [vx_m_s, 0.0, wz_rad_s], action))
        plant.hold(JOINTS, targets_rad(action))
        for _ in range(round(CONTROL_DT_S / plant.dt_s)):
            plant.step()
        state = plant.state
        heels = [plant.data.geom(f"{side}_heel").xpos[2] for side in ("left", "right")]
        turn = state.base_angular_velocity[2]
        rows.append([state.base_linear_velocity[0], turn, state.base_position[2], *heels])
    return np.array(rows).T


@pytest.mark.parametrize(("vx", "wz"), [(0.8, 0.0), (0.4, 0.6)])
def test_the_policy_follows_its_command_on_alternating_feet(policy, vx, wz):
    speed, turn, pelvis, left, right = walked(policy, vx, wz)
    assert pelvis.min() > 0.8
    half = len(speed) // 2
    assert speed[half:].mean() == pytest.approx(vx, abs=0.12)
    assert turn[half:].mean() == pytest.approx(wz, abs=0.12)
    assert np.corrcoef(left[half:], right[half:])[0, 1] < -0.3
    assert min(left[half:].max(), right[half:].max()) > 0.08


def test_the_policy_fits_the_joints_and_observations_of_the_robot(policy):
    assert policy.joints == JOINTS
    assert policy.weights[0].shape == (128, 69)


def test_the_card_of_the_policy_lies_beside_it():
    card = SHIPPED.with_suffix(".md").read_text()
    assert "spikeport train walk" in card


def test_the_policy_stands_still_when_asked_to(policy):
    speed, turn, pelvis, left, right = walked(policy, 0.0, 0.0, seconds=30.0)
    assert pelvis.min() > 0.8
    assert speed.mean() == pytest.approx(0.0, abs=0.01)
    assert turn.mean() == pytest.approx(0.0, abs=0.01)
    settled = len(left) // 10
    assert max(np.ptp(left[settled:]), np.ptp(right[settled:])) < 0.01


def test_the_policy_lets_the_arms_hang(policy):
    arms = [i for i, joint in enumerate(JOINTS) if "shoulder" in joint or "elbow" in joint]
    assert not policy.weights[-1][arms].any()
    assert not policy.biases[-1][arms].any()
