import nengo
import numpy as np
import pytest

from spikeport.experiments.walk.gait import clipped_shares, encoding, record_gait
from spikeport.experiments.walk.loop import (
    LEAD_S,
    LoopedNetwork,
    WalkLoop,
    close_loop,
)
from spikeport.experiments.walk.metrics import command_errors, smoothed
from spikeport.experiments.walk.paths import find_path
from spikeport.experiments.walk.recording import Recording, fallen
from spikeport.networks import walking_policy
from spikeport.networks.region import Box
from spikeport.robot import mirror
from spikeport.robot.walk_interface import PARTS, POSE_RAD

LINE = find_path("line", 0.5, 10.0)
REST = np.zeros(21)


def begun(encoding=None, every_s=0.005, dt_s=0.005):
    loop = WalkLoop(encoding, every_s, dt_s)
    loop.begin(0, LINE)
    return loop


def actions_told(every_s, action=lambda step: step):
    """The last action in each observation, where all that step n gives is ``action(n)``."""
    loop = begun(every_s=every_s)
    for step in range(12):
        loop.step(np.full(21, action(step) * 1e-3))
    return 1e3 * loop.recording().observation[:, PARTS["last action"]][:, 0]


def test_the_last_action_is_that_of_20_ms_before():
    assert actions_told(0.005)[7:] == pytest.approx([3, 4, 5, 6, 7])


def test_actions_between_those_of_20_ms_apart_are_told_too():
    swapping = actions_told(0.005, lambda step: 7 if step % 4 else -7)
    assert np.abs(swapping[7:] - 3.5).max() < 1.6


def test_an_observation_is_held_until_the_next():
    assert actions_told(0.02) == pytest.approx([0, 0, 0, 0, 0, 0, 0, 0, 4, 4, 4, 4])


def test_physics_runs_at_200_hz():
    loop = begun(dt_s=0.001)
    for _ in range(12):
        loop.step(REST)
    assert loop.recording().time_s.tolist() == [0.0, 0.005]
    assert len(loop.poses) == 2


def test_the_reference_is_ahead_and_the_state_is_the_robots():
    loop = begun()
    shown = loop.step(REST)
    assert shown[69:73] == pytest.approx([0.5 * (LEAD_S + 0.005), 0, 0.5, 0])
    x, y = loop.plant.data.qpos[:2]
    assert shown[73:] == pytest.approx([0, x, y, *loop.plant.data.qvel[:2]], abs=1e-3)


def test_the_command_and_the_pose_are_observed():
    loop = begun()
    shown = loop.step(np.concatenate((np.zeros(19), (0.004, -0.003))))
    assert shown[PARTS["command"]].tolist() == [0.004, 0.0, -0.003]
    angles = loop.plant.data.qpos[7:] - POSE_RAD
    assert shown[PARTS["joint angles"]] == pytest.approx(angles)


@pytest.mark.parametrize("every_s", [0.005, 0.02])
def test_commands_change_no_faster_than_in_training(every_s):
    loop = begun(every_s=every_s)
    for command, told in (((0.5, -0.3), (0.1, 0, -0.2)), ((0.0, 0.0), (0, 0, 0))):
        for _ in range(20):
            shown = loop.step(np.concatenate((np.zeros(19), command)))
        assert shown[PARTS["command"]] == pytest.approx(told)


def test_what_is_out_of_range_is_clipped_and_counted():
    box = Box(np.zeros(69), np.full(69, 1e-4))
    loop = begun(box)
    shown = loop.step(np.concatenate((np.zeros(19), (0.4, -0.3))))
    loop.step(REST)
    assert shown[PARTS["command"]] == pytest.approx([1e-4, 0.0, -1e-4])
    seen = loop.recording().observation
    assert seen[1, PARTS["command"]].tolist() == [0.005, 0.0, -0.01]
    shares = clipped_shares(seen, box)
    assert list(shares) == list(PARTS)
    assert shares["command"] == pytest.approx(2 / 6)
    assert shares["last action"] == 0


@pytest.mark.parametrize(
    ("height_m", "tilt_deg", "fell"),
    [(1.0, 0, False), (0.71, 44, False), (0.69, 0, True), (1.0, 46, True)],
)
def test_a_robot_has_fallen_when_low_or_tilted(height_m, tilt_deg, fell):
    assert fallen(height_m, np.cos(np.radians(tilt_deg))) == fell


def test_a_loop_is_over_when_the_robot_fell():
    loop = begun()
    while not loop.over:
        loop.step(np.concatenate((np.full(19, 2.0), (0.0, 0.0))))
    assert loop.fallen_at_s == pytest.approx(loop.plant.time_s)
    assert fallen(loop.plant.data.qpos[2], loop.plant.data.xmat[1][8])


def test_a_controller_is_connected_to_its_parts():
    with nengo.Network() as network:
        controller = LoopedNetwork()
        with controller:
            sizes = {"observation": 69, "reference": 4, "state": 5}
            for name, size in sizes.items():
                setattr(controller, name, nengo.Node(size_in=size))
            controller.action = nengo.Node(np.full(19, 0.1))
            controller.command = nengo.Node([0.4, -0.3])
        loop = begun(dt_s=0.001)
        close_loop(controller, loop)
        probe = nengo.Probe(controller.reference)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(10)
    recording = loop.recording()
    assert recording.action[-1].tolist() == [0.1] * 19
    assert recording.command[-1].tolist() == [0.4, -0.3]
    assert sim.data[probe][-1] == pytest.approx(LINE.at(LEAD_S + 0.01), abs=1e-6)


def test_a_recorded_gait_lies_in_its_encoding():
    gait = record_gait(walking_policy.load(), 3.0)
    assert gait.shape == (1200, 69)
    assert np.array_equal(gait[600:], mirror.OBSERVATION(gait[:600]))
    assert np.array_equal(gait[:50], record_gait(walking_policy.load(), 0.25)[:50])
    box = encoding(gait)
    assert max(clipped_shares(gait, box).values()) < 0.005
    assert box.restore(np.ones(69))[PARTS["command"]] == pytest.approx([1, 0.02, 1])


# metrics


def recorded(speeds, yaw_rates, commands):
    """A robot that moves along y, its heading, upright."""
    n = len(speeds)
    observation = np.zeros((n, 69))
    observation[:, PARTS["gravity"]] = (0, 0, -1)
    observation[:, PARTS["angular velocity"].stop - 1] = yaw_rates
    state = np.zeros((n, 5))
    state[:, 0], state[:, 4] = np.pi / 2, speeds
    blank = np.zeros((n, 19))
    time_s = 0.005 * np.arange(n)
    height_m, on_floor = np.ones(n), np.ones((n, 2), bool)
    return Recording(
        time_s, observation, np.zeros((n, 4)), state, blank, commands, height_m, on_floor
    )


def test_command_errors_are_those_along_the_heading_and_about_the_vertical():
    n = 400
    recording = recorded(np.full(n, 0.4), np.full(n, 0.1), np.tile([0.5, -0.2], (n, 1)))
    assert command_errors(recording) == pytest.approx(np.tile([0.1, -0.3], (n, 1)))


def test_errors_are_smoothed_over_200_ms():
    time_s = 0.005 * np.arange(200)
    sway = np.sin(2 * np.pi * time_s / 0.2)
    assert np.abs(smoothed(sway, time_s)[40:-40]).max() < 1e-9
