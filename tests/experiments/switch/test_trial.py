import dataclasses
import json

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from spikeport.errors import UsageError
from spikeport.experiments import driver
from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.options import Options
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.settings import SwitchSettings
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.networks import walking_policy
from spikeport.robot.description import JOINTS
from tests.helpers.unwritten import outcome

ANALYTIC = ("run", "switch", "--backend", "analytic")
FILES = ["figure.png", "probes.nc", "result.json"]


def switched(folder, schedule="switch", seconds=60.0, backend="analytic", seed=0, **settings):
    options = Options(seconds, backend=backend, seed=seed, pipeline="compact")
    trial = SwitchTrial(SwitchSettings(schedule=schedule, **settings), options)
    driver.run(trial, folder)
    return json.loads((folder / "result.json").read_text())


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(True, id="anchored"),
        pytest.param(False, id="free", marks=pytest.mark.slow),
    ],
)
def exact(request, tmp_path_factory, brief):
    """Return six seconds of the exact controllers."""
    folder = tmp_path_factory.mktemp("exact")
    return folder, switched(folder, brief, anchor=request.param)


# checks before a run


def test_the_selection_of_nengo_spa_is_refused_on_a_backend_with_a_chip():
    trial = SwitchTrial(SwitchSettings(selection="spa"), Options(60.0))
    with pytest.raises(UsageError) as caught:
        trial.check()
    assert str(caught.value) == (
        "selection=spa: neurons have one filter on backend 'native', but nengo_spa's GPi and GPe "
        "need two (AMPA 2 ms, GABA 8 ms); leave it out, or give --backend reference"
    )
    SwitchTrial(SwitchSettings(selection="spa"), Options(60.0, backend="reference")).check()
    unused = SwitchTrial(SwitchSettings(selection="spa"), Options(60.0, backend="analytic")).unused
    assert unused["selection"] == "without neurons; cure: --backend reference, for float ones"


def test_a_schedule_that_leaves_an_uneven_floor_is_refused(tmp_path):
    SwitchTrial(SwitchSettings(terrain="boxes:0.01"), Options(60.0)).check()
    schedule = tmp_path / "fast.toml"
    shipped = SwitchSettings().schedule_file.read_text()
    schedule.write_text(shipped.replace("speed_m_s = 0.5", "speed_m_s = 1.0"))
    settings = {"schedule": str(schedule), "terrain": "boxes:0.01"}
    with pytest.raises(UsageError, match=r"would leave it, up to 1[01]\.[0-9]+ m away"):
        SwitchTrial(SwitchSettings(**settings), Options(60.0)).check()


def test_a_calibration_depends_on_the_points_of_a_users_path(tmp_path):
    path, schedule = tmp_path / "mine.csv", tmp_path / "mine.toml"
    shipped = SwitchSettings().schedule_file.read_text()
    schedule.write_text(shipped.replace('path = "line"\nspeed_m_s = 0.5', f'path = "{path}"'))
    recorded = []
    for end_m in (0.5, 1.0):
        path.write_text(f"t_s,x_m,y_m\n0,0,0\n60,{end_m},0\n")
        trial = SwitchTrial(SwitchSettings(schedule=str(schedule)), Options(60.0))
        recorded.append(trial.recorded)
    assert recorded[0] != recorded[1]
    path.write_text("t_s,x_m,y_m\n0,0,0\n60,0.7,0\n")  # a trial has read its paths
    assert trial.recorded == recorded[1]


def test_a_calibration_of_another_experiment_is_refused_before_the_run(tmp_path):
    file = tmp_path / "calibration.npz"
    DecoderCalibration({"experiment": "reach"}, "", {}).save(file)
    with pytest.raises(UsageError, match=r"made for experiment=reach, .*the run has experiment=sw"):
        SwitchTrial(SwitchSettings(calibrated=str(file)), Options(60.0)).check()


# quality of the run


@pytest.mark.slow
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
@pytest.mark.usefixtures("fair_gait")
def test_a_spiking_humanoid_does_the_four_phases_on_the_chip(monkeypatch):
    monkeypatch.setattr(rehearsal, "SEEDS", (1000,))
    options = Options(60.0, backend="native", pipeline="compact")
    result = outcome(SwitchTrial(SwitchSettings(), options)).result
    figures = result["metrics"]
    assert figures["falls"] == 0
    assert all(phase["success"] for phase in figures["phases"])
    assert figures["recognised_as"] == 8
    assert figures["readout_spikes"] == 0
    assert result["resources"]["cores"]["used"] <= 12  # 10 when this was written
    assert set(figures["spikes_by_nucleus"]) >= {"strD1", "strD2", "stn", "gpe", "gpi"}


# files of a run


def test_the_run_ends_with_its_schedule(exact):
    folder, result = exact
    assert result["seconds"] == 6.0
    with xr.open_dataset(folder / "probes.nc", engine="h5netcdf") as probes:
        assert (probes.sizes["time"], probes.sizes["step"]) == (1200, 6000)
        assert probes.hand.attrs["units"] == "m"
        assert probes.qpos.shape == (1200, 26)
        assert list(probes.selectable.values) == ["walk", "draw"]


def test_the_figure_is_written(exact):
    folder, _ = exact
    assert sorted(path.name for path in folder.iterdir()) == FILES
    with Image.open(folder / "figure.png") as figure:
        assert figure.size == (1870, 1210)
        assert len(figure.convert("RGB").getcolors(10**6)) > 50


@pytest.mark.slow
def test_a_fall_ends_the_run_and_no_phase_succeeds(tmp_path, brief):
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


# refused settings, and the video


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["digit=12"], "unknown digit '12'; choose from: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9"),
        (["preset=fat"], "unknown preset 'fat'; choose from: lean, paper"),
        (
            ["n_neurons=7"],
            "n_neurons=7: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
        (["network_seed=-1"], "network_seed=-1: a seed must be from 0 to 4294967295"),
        (["appearance=wood"], "unknown appearance 'wood'; choose from: menagerie, primitive"),
    ],
)
def test_a_wrong_setting_is_refused_before_the_run(tmp_path, spikeport, settings, message):
    out = tmp_path / "run"
    given = [part for pair in settings for part in ("--set", pair)]
    code, printed, error = spikeport(*ANALYTIC, *given, "--out", out)
    assert (code, printed, error) == (2, "", f"error: {message}\n")
    assert not out.exists()


@pytest.mark.slow
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
