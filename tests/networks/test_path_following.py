import numpy as np
import pytest

from spikeport.networks.path_following import FollowerGains, exact_command, gains_for

GAINS = FollowerGains(kp_speed=1.25, kd_speed=0.1, kp_heading=2.5)


def command(reference, state):
    return exact_command(GAINS, reference, state).tolist()


def test_a_point_straight_ahead_asks_for_speed_alone():
    assert command([1, 2.4, 0, 0.5], [np.pi / 2, 1, 2, 0, 0.5]) == pytest.approx([0.5, 0])


def test_the_size_of_the_velocity_error_adds_speed():
    assert command([0.4, 0, 0.3, 0.4], [0, 0, 0, 0, 0]) == pytest.approx([0.55, 0])


@pytest.mark.parametrize("side", [-1, 1])
def test_a_point_beside_the_heading_asks_for_a_turn_to_it(side):
    bearing = 0.3 + side * 0.2
    reference = [0.4 * np.cos(bearing), 0.4 * np.sin(bearing), 0, 0]
    assert command(reference, [0.3, 0, 0, 0, 0]) == pytest.approx([0.5, side * 0.5])


def test_the_heading_error_takes_the_short_way_round():
    bearing, heading = -3.1, 3.1
    reference = [0.4 * np.cos(bearing), 0.4 * np.sin(bearing), 0, 0]
    turn = 2.5 * (2 * np.pi - 6.2)
    assert command(reference, [heading, 0, 0, 0, 0]) == pytest.approx([0.5, turn])


@pytest.mark.parametrize(("y", "turn"), [(0.01, 1), (-0.01, -1), (0, -1)])
def test_a_point_behind_the_robot_asks_for_the_largest_turn_to_the_nearer_side(y, turn):
    assert command([-0.4, y, 0, 0], [0, 0, 0, 0, 0])[1] == turn


def test_the_speed_has_limits():
    here, far = [0, 0, 0, 0], [3, 0, 0, 0]
    assert command(here, [0, 0, 0, 0, 0])[0] == 0.01
    assert command(far, [0, 0, 0, 0, 0])[0] == 1
    assert GAINS.reach_m == 0.8


def test_commands_for_many_states_equal_those_for_each_state():
    reference, states = np.array([0.4, 0.1, 0, 0]), np.random.RandomState(0).randn(3, 2, 5)
    commands = exact_command(GAINS, reference, states)
    assert commands.shape == (3, 2, 2)
    assert commands[1, 0] == pytest.approx(exact_command(GAINS, reference, states[1, 0]))


@pytest.mark.parametrize("turn_lag_s", [0.0, 0.2])
def test_a_robot_that_lags_stays_on_a_circle(turn_lag_s):
    """The heading is ahead of the course by the lag times the yaw rate, here a small angle."""
    radius, speed = 10.0, 0.5
    gains = gains_for(turn_lag_s, kp_speed=1.1)
    distance, yaw_rate = speed / gains.kp_speed, speed / radius
    beside = distance**2 / (2 * radius)
    reference = [distance, beside, 0, 0]
    found = exact_command(gains, reference, [turn_lag_s * yaw_rate, 0, 0, 0, 0])
    assert found.tolist() == pytest.approx([speed, yaw_rate], rel=0.01)


def test_on_a_circle_the_robot_turns_as_the_circle_does():
    """To 1 %: chord over arc at 0.2 rad is 0.9933."""
    radius, half = 1.0, 0.2
    ahead = radius * np.array([np.sin(2 * half), 1 - np.cos(2 * half)])
    speed, yaw_rate = command([*ahead, 0, 0], [0, 0, 0, 0, 0])
    assert yaw_rate / speed == pytest.approx(1 / radius, rel=0.01)
