import dataclasses
import json

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from spikeport.experiments import driver
from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.options import Options
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.frames import Frame
from spikeport.experiments.switch.gate import HumanoidRig
from spikeport.experiments.switch.goals import (
    Goal,
    RetractTask,
    find_goals,
    from_stand_to_stand,
    hanging_hand,
)
from spikeport.experiments.switch.metrics import switched_after_s
from spikeport.experiments.switch.schedule import Phase
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.experiments.walk.paths import find_path
from spikeport.networks import walking_policy
from spikeport.robot.description import JOINTS
from spikeport.robot.plant import Plant
from spikeport.robot.walk_interface import PARTS

ANALYTIC = ("run", "switch", "--backend", "analytic")
FILES = ["figure.png", "probes.nc", "result.json"]
WALK, DRAW = {"walk": 0.8, "draw": 0.4}, {"walk": 0.4, "draw": 0.8}


def switched(folder, schedule="switch", seconds=60.0, backend="analytic", seed=0, **settings):
    options = Options(seconds, backend=backend, seed=seed, pipeline="compact")
    trial = SwitchTrial(SwitchSettings(schedule=schedule, **settings), options)
    driver.run(trial, folder)
    return json.loads((folder / "result.json").read_text())


@pytest.fixture(scope="module", params=[True, False], ids=["anchored", "free"])
def exact(request, tmp_path_factory, brief):
    """Six seconds of the exact controllers."""
    folder = tmp_path_factory.mktemp("exact")
    return folder, switched(folder, brief, anchor=request.param)


# how well it does


def test_the_exact_controllers_walk_and_reach(exact):
    figures = exact[1]["metrics"]
    assert (figures["falls"], figures["fallen_at_s"]) == (0, None)
    walk, reach, retract, walk_on = figures["phases"]
    assert all(phase["success"] for phase in (walk, reach, walk_on))
    assert 3 <= reach["targets_reached"] <= 8
    assert retract["hand_error_m"] < 0.08
    assert all(phase["switching_time_s"] <= 0.002 for phase in figures["phases"])
    assert figures["spikes_by_nucleus"] == {}


def test_an_anchored_pelvis_stays_and_a_free_one_does_not(exact):
    _, result = exact
    moved_m = [phase.get("pelvis_moved_m") for phase in result["metrics"]["phases"]][1:3]
    if result["settings"]["anchor"]:
        assert max(moved_m) < 0.02
    else:
        assert 0.02 < max(moved_m) < 0.5


@pytest.mark.slow
def test_spikes_do_the_four_phases_on_the_chip(tmp_path):
    result = switched(tmp_path, backend="native")
    figures = result["metrics"]
    assert figures["falls"] == 0
    assert all(phase["success"] for phase in figures["phases"])
    assert figures["recognised_as"] == 8
    assert figures["readout_spikes"] == 0
    assert result["resources"]["cores"]["used"] <= 64
    assert set(figures["spikes_by_nucleus"]) >= {"strD1", "strD2", "stn", "gpe", "gpi"}


# what it writes


def test_the_run_ends_with_its_schedule(exact):
    folder, result = exact
    assert result["seconds"] == 6.0
    with xr.open_dataset(folder / "probes.nc", engine="h5netcdf") as probes:
        assert (probes.sizes["time"], probes.sizes["step"]) == (1200, 6000)
        assert probes.hand.attrs["units"] == "m"
        assert list(probes.selectable.values) == ["walk", "draw"]


def test_the_figure_is_written(exact):
    folder, _ = exact
    assert sorted(path.name for path in folder.iterdir()) == FILES
    with Image.open(folder / "figure.png") as figure:
        assert figure.size == (1870, 1210)
        assert len(figure.convert("RGB").getcolors(10**6)) > 50


# the loop


def phase(begin_s, end_s, utilities, **goal):
    return Phase(name="one", begin_s=begin_s, end_s=end_s, utilities=utilities, **goal)


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


def test_an_anchored_robot_is_brought_upright_and_let_go(rig, brief):
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
    *_, hand, target = rig.arm.seen
    assert rig.gate.utilities.tolist() == [0.8, 0.4]
    assert target == pytest.approx(hand)
    step(rig, (1, 0))
    *_, hand, target = rig.arm.seen
    assert rig.gate.utilities.tolist() == [0.4, 0.8]
    assert np.linalg.norm(target - hand) > 0.1


def test_the_hand_is_seen_from_an_upright_torso(rig, brief, law):
    begin(rig, brief)
    rig.plant.data.qpos[:7] = 3, 2, 0.9, np.cos(0.3), 0, 0, np.sin(0.3)
    rig.plant.data.joint("torso").qpos = 0.2
    step(rig, (1, 0))
    q, _, hand, _ = rig.arm.seen
    assert hand == pytest.approx(law.arm.at(q).position, abs=1e-9)


def test_a_sheet_is_steady_once_the_pen_is_down_and_follows_slowly(rig, drawn):
    begin(rig, drawn)
    for _ in range(620):
        step(rig, (0, 1))
    before = rig.place.sheet
    rig.plant.anchor(np.add(rig.plant.data.qpos[:7], [0.02, 0, 0, 0, 0, 0, 0]))
    for _ in range(10):
        step(rig, (0, 1))
    *_, target = rig.arm.seen
    torso = Frame.of_torso(rig.plant.data, rig.plant.model.body("torso_link").id)
    assert torso.world(target) == pytest.approx(rig.place.sheet.world(rig.place.task.target))
    moved_m = np.linalg.norm(rig.place.sheet.origin - before.origin)
    assert 0 < moved_m < 0.1 * np.linalg.norm(torso.upright().origin - before.origin)


def test_a_path_begins_where_the_robot_is(rig, brief):
    begin(rig, brief)
    for _ in range(1000):
        step(rig, (0, 1))
    _, reference, state = rig.walk.seen
    heading, place = state[0], state[1:3]
    begun_m = 0.5 * 0.8**2 / 2 / 0.9  # in a ramp of 0.9 s, the reference being 0.8 s ahead
    ahead = place + begun_m * np.array([np.cos(heading), np.sin(heading)])
    assert reference[:2] == pytest.approx(ahead, abs=1e-3)
    assert len(rig.gate.paths) == 4


# goals


def test_a_path_is_walked_from_a_stand_to_a_stand():
    path = from_stand_to_stand(find_path("line", 0.5, 6.0), 6.0)
    x, y, vx, vy = np.array([path.at(t) for t in np.linspace(0, 6, 601)]).T
    assert (x[0], x[-1]) == pytest.approx((0, 2.5), abs=1e-3)
    assert (vx[1], vx[300], vx[-1]) == pytest.approx((0, 0.5, 0), abs=0.02)
    assert np.abs(np.diff(vx)).max() <= 0.5 * 0.02 + 1e-6
    assert not y.any()
    assert not vy.any()


@pytest.mark.parametrize(("anchor", "told"), [(True, False), (False, True)])
def test_a_policy_that_balances_knows_the_arm_at_work(brief, monkeypatch, anchor, told):
    monkeypatch.setattr(rehearsal, "record_gait", lambda policy: np.zeros((1, 69)))
    settings = SwitchSettings(schedule=brief, anchor=anchor)
    trial = SwitchTrial(settings, Options(6.0))
    found = trial.rehearsals(trial.exact()).record()
    elbow = found.observations[:, PARTS["joint angles"]][:, JOINTS.index("right_elbow")]
    assert (np.ptp(elbow) > 0.6) == told
    assert np.ptp(found.region.q_samples[:, -1]) > 0.6


def test_the_arm_is_retracted_to_where_it_hangs():
    begin = np.array([0.35, -0.2, 1.2])
    task = RetractTask(begin, 2.0)
    assert task.target.tolist() == begin.tolist()
    task.update(1.5, begin)
    assert task.target == pytest.approx(hanging_hand())


def test_a_drawing_phase_draws_the_digit_asked_for():
    goal = Goal(phase(0, 6, DRAW, arm="digit"), None, 5, 0)
    task = goal.task(np.zeros(3))
    assert np.array_equal(task.stroke, Sheet().stroke(5))


# metrics


def test_a_switch_is_over_when_the_gate_stays_open():
    gates = np.tile([0.9, 0.1], (1000, 1))
    gates[500:] = 0.1, 0.9
    gates[520:530] = 0.6, 0.9
    assert switched_after_s(gates, phase(0.5, 1.0, DRAW, arm="reach")) == pytest.approx(0.03)
    assert switched_after_s(gates, phase(0.0, 0.5, WALK, path="line")) == 0


def test_a_fall_ends_the_run_and_all_later_phases(tmp_path, brief):
    weights = walking_policy.load()
    *hidden, last = weights.biases
    squat = np.where(["knee" in joint for joint in JOINTS], 4.0, 0.0)
    limp = dataclasses.replace(weights, biases=(*hidden, last + squat))
    limp.save(tmp_path / "limp.npz")
    figures = switched(tmp_path / "run", brief, policy=f"{tmp_path}/limp.npz")["metrics"]
    assert figures["falls"] == 1
    assert 0.1 < figures["fallen_at_s"] < 1.0
    assert [phase["success"] for phase in figures["phases"]] == [False] * 4
    unseen = {"name": "phase 1", "success": False, "switching_time_s": None}
    assert figures["phases"][1] == unseen
    left = {"result.json", "probes.nc", "figure.png", "last_states.npz"}
    assert {path.name for path in (tmp_path / "run").iterdir()} == left


# what it refuses


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["digit=12"], "unknown digit '12'; there is: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9"),
        (["preset=fat"], "unknown preset 'fat'; there is: lean, paper"),
        (
            ["n_neurons=7"],
            "n_neurons=7: a unit has as many neurons for each sign; give an even number from 2 on",
        ),
        (["network_seed=-1"], "network_seed=-1: a seed must be from 0 to 4294967295"),
        (["appearance=wood"], "unknown appearance 'wood'; there is: menagerie, primitive"),
    ],
)
def test_what_is_wrong_is_told_before_the_run(tmp_path, spikeport, settings, message):
    out = tmp_path / "run"
    given = [part for pair in settings for part in ("--set", pair)]
    code, printed, error = spikeport(*ANALYTIC, *given, "--out", out)
    assert (code, printed, error) == (2, "", f"error: {message}\n")
    assert not out.exists()


def test_a_video_shows_path_and_hand(tmp_path, drawn, monkeypatch):
    asked = []
    monkeypatch.setattr(driver, "write_video", lambda *arguments: asked.append(arguments))
    monkeypatch.setattr(driver, "check_video", lambda *_: None)
    options = Options(5.0, backend="analytic", video=True)
    driver.run(SwitchTrial(SwitchSettings(schedule=drawn), options), tmp_path)
    ((_, film, (marks, camera, captions, _)),) = asked
    assert camera == "track"
    assert len(film.poses) == 1000
    assert len(marks(1)) == len(marks(600)) < len(marks(1000))
    assert (
        captions(100).text == "  0.5 s   phase 0   utilities: walk 0.8, draw 0.4   selected: walk"
    )
    assert captions(100).colour != captions(300).colour
