"""The loop of arm, legs and gates, step by step."""

import numpy as np
import pytest

from spikeport.experiments.arm.draw_task import DrawTask
from spikeport.experiments.switch.frames import Frame
from spikeport.experiments.switch.gate import HumanoidRig
from spikeport.experiments.switch.goals import (
    find_goals,
)
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.robot.engine import mujoco
from spikeport.robot.plant import Plant


@pytest.fixture(scope="module")
def rig():
    return HumanoidRig(Plant(), True, None, 0.005, 0.005)


def begin(rig, brief):
    schedule = SwitchSettings(schedule=brief).load_schedule(6.0)
    rig.begin(0, find_goals(schedule, 8, 0))


def step(rig, gates, torque=(0, 0, 0, 0)):
    rig.loop.step(np.concatenate((np.zeros(21), torque, gates)))


def test_the_gates_decide_what_drives_the_arm(rig, brief):
    begin(rig, brief)
    for gates, expected in (((1, 0), 0.28), ((0.6, 0.4), 0.28), ((0, 1), 3.0), ((1, 0), 0.28)):
        step(rig, gates, (3.0, 0, 0, 0))
        assert rig.plant.data.ctrl[-4] == pytest.approx(expected)
        assert rig.plant.anchored == (gates[1] > 0.5)


def test_an_anchored_robot_is_brought_upright_and_released(rig, brief):
    begin(rig, brief)
    height_m = rig.plant.data.qpos[2]
    rig.plant.data.qpos[3:7] = np.cos(0.1), 0, np.sin(0.1), 0
    for _ in range(240):
        step(rig, (0, 1))
    w, x, y, _ = rig.plant.data.qpos[3:7]
    assert [w, x, y] == pytest.approx([1, 0, 0], abs=5e-3)
    assert rig.plant.data.qpos[2] == pytest.approx(height_m, abs=5e-3)
    step(rig, (1, 0))
    assert not rig.plant.anchored


def test_the_schedule_gives_utilities_and_targets(rig, brief):
    begin(rig, brief)
    for _ in range(199):
        step(rig, (1, 0))
    *_, hand, target = rig.arm.inputs
    assert rig.gate.utilities.tolist() == [0.8, 0.4]
    assert target == pytest.approx(hand)
    step(rig, (1, 0))
    *_, hand, target = rig.arm.inputs
    assert rig.gate.utilities.tolist() == [0.4, 0.8]
    assert np.linalg.norm(target - hand) > 0.1


def test_the_hand_is_observed_in_the_frame_of_the_torso(rig, brief, law):
    begin(rig, brief)
    rig.plant.data.qpos[:7] = 3, 2, 0.9, np.cos(0.3), 0, 0, np.sin(0.3)
    rig.plant.data.joint("torso").qpos = 0.2
    step(rig, (1, 0))
    q, _, hand, _ = rig.arm.inputs
    assert hand == pytest.approx(law.arm.at(q).position, abs=1e-9)


def test_once_the_pen_is_down_the_sheet_follows_the_torso_slowly(rig, drawn):
    begin(rig, drawn)
    for _ in range(620):
        step(rig, (0, 1))
    before = rig.place.sheet
    rig.plant.anchor(np.add(rig.plant.data.qpos[:7], [0.02, 0, 0, 0, 0, 0, 0]))
    for _ in range(10):
        step(rig, (0, 1))
    *_, target = rig.arm.inputs
    torso = Frame.of_torso(rig.plant.data, rig.plant.model.body("torso_link").id)
    assert torso.world(target) == pytest.approx(rig.place.sheet.world(rig.place.task.target))
    moved_m = np.linalg.norm(rig.place.sheet.origin - before.origin)
    assert 0 < moved_m < 0.1 * np.linalg.norm(torso.upright().origin - before.origin)


@pytest.mark.parametrize("rounding_s", [-1e-12, 0.0, 1e-12])
def test_the_sheet_stays_where_the_pen_sets_down(rig, drawn, rounding_s):
    begin(rig, drawn)
    for _ in range(210):
        step(rig, (0, 1))
    place, data = rig.place, rig.plant.data
    down_s = rig.gate.goals[1].phase.begin_s + DrawTask.begin_s + rounding_s
    data.time = down_s - rig.plant.dt_s
    for time_s, moves in ((down_s, True), (down_s + rig.plant.dt_s, False)):
        before_m = place.sheet.origin[0]
        data.qpos[0] += 0.1
        mujoco.mj_forward(rig.plant.model, data)
        data.time = time_s
        place.places()
        assert (place.sheet.origin[0] - before_m > 0.05) == moves


def test_a_path_begins_where_the_robot_is(rig, brief):
    begin(rig, brief)
    for _ in range(1000):
        step(rig, (0, 1))
    _, reference, state = rig.walk.inputs
    heading, place = state[0], state[1:3]
    begun_m = 0.5 * 0.8**2 / 2 / 0.9  # in a ramp of 0.9 s, the reference being 0.8 s ahead
    ahead = place + begun_m * np.array([np.cos(heading), np.sin(heading)])
    assert reference[:2] == pytest.approx(ahead, abs=1e-3)
    assert len(rig.gate.paths) == 4


def test_a_robot_stands_where_the_reference_of_a_users_path_does(rig, tmp_path, phases):
    stands, schedule = tmp_path / "stands.csv", tmp_path / "schedule.toml"
    stands.write_text("t_s,x_m,y_m\n0,0,0\n9,0,0\n")
    goals = (1, 'path = "line"'), (1, f'path = "{stands}"'), (1, 'arm = "retract"')
    schedule.write_text(phases(*goals))
    begin(rig, str(schedule))
    for _ in range(220):
        rig.loop.step(np.concatenate((np.zeros(19), [1.0, 0.5], np.zeros(4), [1, 0])))
    commands = rig.walk.recording().command
    assert (commands[:199] == [1.0, 0.5]).all()
    assert not commands[200:].any()
