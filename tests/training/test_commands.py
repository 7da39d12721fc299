import numpy as np
import pytest

from spikeport.training.commands import CommandRange, Commands


def drawn(n=4000, **ranges):
    return Commands(n, CommandRange(**ranges), np.random.default_rng(0))


def test_speeds_are_within_their_ranges():
    value = drawn(vx_m_s=(0.4, 1.0), wz_rad_s=0.6, heading=0.0).wanted
    assert value[:, 0].min() >= 0.4
    assert value[:, 0].max() <= 1.0
    assert np.abs(value[:, 2]).max() <= 0.6
    assert (value[:, 1] == 0).all()


def test_standing_and_turning_in_place_have_their_shares():
    commands = drawn(vx_m_s=(0.5, 1.0), standing=0.2, turning=0.3, heading=0.0)
    still = commands.wanted[:, 0] == 0
    assert np.mean(still) == pytest.approx(0.5, abs=0.03)
    assert np.mean(still & (commands.wanted[:, 2] == 0)) == pytest.approx(0.2, abs=0.03)


def test_a_robot_turns_to_its_heading_the_short_way():
    commands = drawn(200, heading=1.0, wz_rad_s=0.5, heading_gain=2.0, seconds=(99.0, 99.0))
    turned = np.zeros(200)
    for step in range(500):
        commands.update(3.0 + turned)
        wz = commands.wanted[:, 2]
        if step == 0:
            assert (wz.min(), wz.max()) == (-0.5, 0.5)
        turned += 0.02 * wz
    assert np.abs(wz).max() < 0.01
    assert -np.pi < turned.min() < -3
    assert 3 < turned.max() < np.pi


def test_commands_change_after_their_time():
    commands = drawn(1, seconds=(0.1, 0.1), heading=0.0)
    first = commands.wanted.copy()
    for _ in range(4):
        commands.update(np.zeros(1))
    assert (commands.wanted == first).all()
    assert commands.age_s == pytest.approx(0.08)
    commands.update(np.zeros(1))
    assert (commands.wanted != first).any()
    assert commands.age_s == 0


def test_robots_with_small_commands_need_not_step():
    commands = drawn(3, still=0.1)
    commands.value[:] = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.09], [0.0, 0.0, -0.2]]
    assert commands.moving.tolist() == [False, False, True]
    commands = drawn(3, still=0.0)
    commands.value[:] = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.09], [0.0, 0.0, -0.2]]
    assert commands.moving.tolist() == [False, True, True]


def test_the_moving_time_counts_from_the_first_command_to_move():
    commands = drawn(
        1, vx_m_s=(1.0, 1.0), wz_rad_s=0.0, heading=0.0, still=0.09, seconds=(9.0, 9.0)
    )
    times = []
    for _ in range(7):
        commands.update(np.zeros(1))
        times.append(commands.moving_s[0])
    # The command grows by 0.02 m/s a step: from the fifth on it asks to move.
    assert times == pytest.approx([0, 0, 0, 0, 0.02, 0.04, 0.06])
    commands.restart(np.ones(1, bool))
    assert commands.moving_s == 0


def test_commands_change_no_faster_than_a_robot_can_follow():
    commands = drawn(2, vx_m_s=(1.0, 1.0), wz_rad_s=1.0, heading=0.0, seconds=(9.0, 9.0))
    assert not commands.value.any()
    for _ in range(25):
        commands.update(np.zeros(2))
    assert commands.value[:, 0] == pytest.approx(0.5)
    for _ in range(25):
        commands.update(np.zeros(2))
    assert commands.value == pytest.approx(commands.wanted)
    commands.restart(np.array([True, False]))
    assert commands.moving.tolist() == [False, True]


def test_jumping_commands_change_at_once():
    commands = drawn(2, jumping=1.0, heading=0.0)
    commands.update(np.zeros(2))
    assert (commands.value == commands.wanted).all()
