import contextlib
import dataclasses
import json
import shutil
import warnings
from pathlib import Path

import nengo
import numpy as np
import pytest
import xarray as xr
from PIL import Image

from spikeport.cache import Cache
from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError
from spikeport.experiments import driver
from spikeport.experiments.calibration import DecoderCalibration
from spikeport.experiments.digests import digest
from spikeport.experiments.options import Options
from spikeport.experiments.walk import trial as walk_trial
from spikeport.experiments.walk.settings import WalkSettings
from spikeport.experiments.walk.trial import WalkTrial
from spikeport.find_network import find_network
from spikeport.hardware_models.chip import BUILT_IN
from spikeport.networks import walking_policy
from spikeport.networks.policy import PolicyNetwork
from spikeport.robot.description import JOINTS
from tests.helpers.results import RESULT_FIELDS
from tests.helpers.sweeps import write_path
from tests.helpers.unwritten import outcome

ANALYTIC = ("run", "walk", "--backend", "analytic", "--seconds", "0.5")
FILES = ["figure.png", "probes.nc", "result.json"]
METRICS = [
    *("falls", "fallen_at_s", "cross_track_rms_m", "cross_track_max_m", "path_mse_m2"),
    *("speed_error_mean_m_s", "yaw_rate_error_mean_rad_s"),
]


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def walk(seconds, backend="analytic", seed=0, **settings):
    options = Options(seconds, backend=backend, seed=seed, pipeline="compact")
    return WalkTrial(WalkSettings(**settings), options)


def walked(folder, seconds, backend="analytic", **settings):
    driver.run(walk(seconds, backend, **settings), folder)
    return json.loads((folder / "result.json").read_text())


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    """Return three seconds of the exact policy with the exact follower."""
    folder = tmp_path_factory.mktemp("exact")
    return folder, walked(folder, 3.0, path="line")


# quality of the walk


@pytest.mark.slow
def test_the_exact_controller_walks_ahead(exact):
    figures = exact[1]["metrics"]
    assert (figures["falls"], figures["fallen_at_s"]) == (0, None)
    assert figures["cross_track_max_m"] < 0.05
    assert figures["speed_error_mean_m_s"] < 0.2
    assert figures["spikes_per_second"] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "seconds"), [("line", 10.0), ("s-curve", 20.0), ("figure-eight", 33.0), ("loop", 33.0)]
)
def test_the_exact_controller_follows_every_path(path, seconds):
    """Walk far enough to take each turn of a path once."""
    figures = outcome(walk(seconds, path=path)).result["metrics"]
    assert figures["falls"] == 0
    assert figures["cross_track_rms_m"] < 0.04
    assert figures["path_mse_m2"] < 0.25


@pytest.mark.slow
@pytest.mark.usefixtures("fair_gait")
def test_a_spiking_policy_follows_a_path_on_the_chip():
    result = outcome(walk(10.0, "native", path="s-curve")).result
    assert result["metrics"]["falls"] == 0
    assert result["metrics"]["cross_track_max_m"] < 0.3
    assert result["metrics"]["spikes_per_second"] > 1e5
    assert result["metrics"]["clipped_joint_angles"] < 0.1
    assert result["resources"]["cores"]["used"] == 5


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_a_calibration_is_made_once_and_used_again(tmp_path, pocket):
    file, small = tmp_path / "calibration.npz", {"n_neurons": 2, "policy": pocket}
    walk(0.5, "native", **small).calibrate().save(file)
    nominal, made, read = (
        outcome(walk(0.3, "native", **small, calibrated=given)).result
        for given in (False, True, str(file))
    )
    assert made["image_digest"] == read["image_digest"] != nominal["image_digest"]
    for result in (made, read):
        del result["metrics"]["real_time_factor"]
    assert made["metrics"] == read["metrics"]
    with pytest.raises(UsageError) as caught:
        walk(0.3, "native", policy=pocket, calibrated=str(file)).check()
    assert str(caught.value) == (
        f"calibrated={file}: made for n_neurons=2, but the run has n_neurons=4; make it with "
        "`spikeport calibrate`, the settings of the run, and --out"
    )


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_settings_of_the_conversion_change_the_image(pocket):
    small = {"n_neurons": 2, "backend": "native", "policy": pocket, "calibrated": False}
    digests = set()
    for chosen in ({}, {"units": "if"}, {"solve": "layer"}):
        with contextlib.closing(driver.prepare(walk(0.1, **small, **chosen))) as ready:
            digests.add(ready.sim.image.digest)
    assert len(digests) == 3


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_the_built_in_network_gives_the_image_of_the_run(pocket):
    run = outcome(walk(0.1, "native", n_neurons=2, policy=pocket)).result
    network = find_network("walk", ["n_neurons=2", f"policy={pocket}"])
    assert compile_network(network, pipeline="compact").image.digest == run["image_digest"]


@pytest.mark.slow
@pytest.mark.usefixtures("short_gait")
def test_a_board_does_what_the_native_backend_does(tmp_path, pocket):
    folders = [tmp_path / backend for backend in ("native", "board")]
    small = {"n_neurons": 2, "policy": pocket, "calibrated": False}
    native, board = (walked(f, 0.2, backend=f.name, **small) for f in folders)
    for found in (native, board):
        del found["metrics"]["real_time_factor"]
    for key in ("metrics", "activity", "image_digest", "energy"):
        assert native[key] == board[key]
    one, other = (xr.open_dataset(folder / "probes.nc") for folder in folders)
    assert one.identical(other)
    assert (board["link"]["steps"], board["link"]["held"]) == (200, 0)


# files of a run


def test_the_result_has_every_field(exact):
    result = exact[1]
    assert tuple(result) == RESULT_FIELDS
    assert list(result["metrics"]) == [*METRICS, "spikes_per_second", "real_time_factor"]
    assert result["settings"]["path"] == "line"
    assert result["files"] == {}


@pytest.mark.slow
def test_the_result_has_the_digests_of_the_files_that_the_run_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_path(Path("path.csv"), 0.3)
    shutil.copy(BUILT_IN / "loihi.toml", "own.toml")
    named = {name: digest(Path(name)) for name in ("own.toml", "path.csv")}
    options = Options(0.1, backend="analytic", chip="own.toml")
    found = driver.run(WalkTrial(WalkSettings(path="path.csv"), options), tmp_path / "run")
    assert found.result["files"] == named


def test_a_file_that_changes_while_the_network_is_made_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_path(Path("path.csv"), 0.3)
    close_loop = WalkTrial.close_loop

    def changing(*arguments):
        closed = close_loop(*arguments)
        write_path(Path("path.csv"), 0.2)
        return closed

    monkeypatch.setattr(WalkTrial, "close_loop", changing)
    trial = WalkTrial(WalkSettings(path="path.csv"), Options(0.1, backend="analytic"))
    with pytest.raises(UsageError, match=r"path\.csv: changed while the network was made"):
        driver.run(trial, tmp_path / "run")


def test_the_metrics_are_those_of_the_probes(exact):
    folder, result = exact
    with xr.open_dataset(folder / "probes.nc", engine="h5netcdf") as probes:
        place = probes.state.sel(turned=["x", "y"]).values
        reference = probes.reference.sel(moving=["x", "y"]).values
        assert probes.sizes["time"] == 600
        assert probes.height.min() > 0.8
    figures = result["metrics"]
    late = np.sum((place - reference) ** 2, axis=1)
    assert figures["path_mse_m2"] == pytest.approx(late.mean())
    off_track = np.where(place[:, 0] > 0, np.abs(place[:, 1]), np.hypot(*place.T))
    assert figures["cross_track_max_m"] == pytest.approx(off_track.max(), abs=1e-3)


def test_the_probes_have_names_and_units(exact):
    with xr.open_dataset(exact[0] / "probes.nc", engine="h5netcdf") as probes:
        assert probes.observation.dims == ("time", "observed")
        assert (probes.part == "command").sum() == 3
        assert probes.command.attrs["units"] == "m/s, rad/s"
        assert list(probes.foot.values) == ["left", "right"]


def test_the_folder_holds_three_files(exact):
    assert names(exact[0]) == FILES
    with Image.open(exact[0] / "figure.png") as figure:
        assert figure.size == (1320, 1320)
        assert len(figure.convert("RGB").getcolors(10**6)) > 50


@pytest.mark.slow
def test_two_runs_differ_in_wall_clock_time_only():
    a, b = (outcome(walk(0.2, seed=3)).result for _ in range(2))
    for result in (a, b):
        del result["metrics"]["real_time_factor"]
    assert a == b


# ends of a run


def acting(values):
    """Return a builder of a policy that gives the same action from 50 ms on."""

    def build(_weights):
        with PolicyNetwork(label="acting") as net:
            net.observation = nengo.Node(size_in=69)
            net.action = nengo.Node(size_in=19)
            sent = nengo.Node(lambda t: values * (t > 0.05))
            for _ in range(2):  # Nengo refuses an infinite output, but not an infinite sum
                nengo.Connection(sent, net.action, synapse=None)
        return net

    return build


@pytest.mark.slow
def test_a_fall_ends_the_run_with_metrics_picture_and_last_states(tmp_path, monkeypatch):
    squat = np.where(["knee" in joint for joint in JOINTS], 1.5, 0.0)
    monkeypatch.setattr(walk_trial, "analytic_policy", acting(squat))
    result = walked(tmp_path, 5.0)
    fallen_at_s = result["metrics"]["fallen_at_s"]
    assert result["metrics"]["falls"] == 1
    assert 0.1 < fallen_at_s < 3.0
    assert names(tmp_path) == ["figure.png", "last_states.npz", "probes.nc", "result.json"]
    with np.load(tmp_path / "last_states.npz") as states:
        assert states["time_s"][-1] == pytest.approx(fallen_at_s)
    with xr.open_dataset(tmp_path / "probes.nc", engine="h5netcdf") as probes:
        assert probes.time[-1] == pytest.approx(fallen_at_s - 0.005)


@pytest.mark.filterwarnings("ignore:overflow")
def test_an_action_that_is_not_finite_ends_the_run(tmp_path, spikeport, monkeypatch):
    out = tmp_path / "run"
    monkeypatch.setattr(walk_trial, "analytic_policy", acting(np.full(19, 1e308)))
    code, printed, error = spikeport(*ANALYTIC, "--out", out)
    assert (code, printed) == (1, "")
    assert error == (
        "error: the controller's action or command is not finite at 0.050 s: value 0 of 21, "
        "counted from 0, is inf; cure: look at its inputs in the last states; the last states are "
        f"in {out}/last_states.npz\n"
    )
    assert names(out) == ["last_states.npz"]


# refusals


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"follower": "late"}, "unknown follower 'late'; choose from: exact, spiking"),
        (
            {"policy": "nowhere.npz"},
            "policy=nowhere.npz: no such file; cure: one of spiking, mlp, h1_robust, h1_walk, or "
            "the path of a file",
        ),
        ({"ramp": -1.0}, "ramp=-1: a time must be from 0 on and finite"),
        (
            {"speed": 1.5},
            "speed=1.5: the policy is trained for speeds above 0 and up to 1 m/s; choose one of "
            "these",
        ),
        (
            {"path": "own.csv", "speed": 0.3},
            "speed=0.3: 'own.csv' has times of its own; cure: leave it out, or change the times",
        ),
        (
            {"n_neurons": 7},
            "n_neurons=7: a unit has half its neurons for each sign; use an even number, 2 or more",
        ),
        ({"units": "elu"}, "unknown units 'elu'; choose from: bent, hybrid, if, lif, relu"),
        ({"solve": "all"}, "unknown solve 'all'; choose from: layer, unit"),
        ({"tau_fwd": 0}, "tau_fwd=0: a filter must be above 0 and below 1 s"),
        ({"network_seed": -1}, "network_seed=-1: a seed must be from 0 to 4294967295"),
    ],
)
def test_a_wrong_setting_says_what_is_allowed(wrong, message):
    with pytest.raises(UsageError) as caught:
        WalkSettings(**wrong)
    assert str(caught.value) == message


def test_a_calibration_of_another_experiment_is_refused_before_the_run(tmp_path):
    file = tmp_path / "calibration.npz"
    DecoderCalibration({"experiment": "reach"}, "", {}).save(file)
    with pytest.raises(UsageError, match=r"made for experiment=reach, .*the run has experiment=wa"):
        WalkTrial(WalkSettings(calibrated=str(file)), Options(1.0)).check()


def test_a_policy_without_neurons_is_not_calibrated():
    with pytest.raises(UsageError, match="policy=mlp: has no neurons to calibrate"):
        WalkTrial(WalkSettings(policy="mlp"), Options(1.0)).calibrate()


def test_a_path_that_cannot_be_followed_is_refused_before_the_run(tmp_path, spikeport):
    out = tmp_path / "run"
    code, printed, error = spikeport(*ANALYTIC, "--set", "path=circle", "--out", out)
    assert (code, printed) == (2, "")
    assert error == (
        "error: unknown path 'circle'; choose from: FILE.csv, figure-eight, line, loop, s-curve\n"
    )
    assert not out.exists()


@pytest.mark.parametrize(
    ("settings", "seconds", "message"),
    [
        (
            {"silence": 0.5},
            25.0,
            "silence=0.5: begins at silence_at=25 s, and the run ends at 25 s; cure: an earlier "
            "silence_at, or more --seconds",
        ),
        (
            {"push": 0.8, "push_every": 80.0},
            40.0,
            "push=0.8: with push_every=80 the first push comes 40 s after the start or later, and "
            "the run ends at 40 s; cure: a smaller push_every, or more --seconds",
        ),
    ],
)
def test_an_event_that_a_run_would_not_reach_is_refused(settings, seconds, message):
    """The robot would walk undisturbed, and seem to bear it."""
    with pytest.raises(UsageError) as caught:
        WalkTrial(WalkSettings(**settings), Options(seconds)).check()
    assert str(caught.value) == message
    WalkTrial(WalkSettings(**settings), Options(seconds + 1.0)).check()


def test_a_path_that_leaves_an_uneven_floor_is_refused_before_the_run():
    options = Options(40.0, backend="analytic")
    WalkTrial(WalkSettings(terrain="boxes:0.01"), options).check()
    WalkTrial(WalkSettings(terrain="slope:6", path="line"), options).check()
    with pytest.raises(UsageError, match=r"would leave it, up to 20\.00 m away"):
        WalkTrial(WalkSettings(terrain="boxes:0.01", path="line"), options).check()


def test_a_policy_with_other_observations_is_refused_before_the_run(tmp_path, spikeport):
    out, file, shipped = tmp_path / "run", tmp_path / "policy.npz", walking_policy.load()
    first, *rest = shipped.weights
    dataclasses.replace(shipped, weights=(first[:, :60], *rest)).save(file)
    code, printed, error = spikeport(*ANALYTIC, "--set", f"policy={file}", "--out", out)
    assert (code, printed) == (2, "")
    assert error == (
        f"error: policy file '{file}': expected 69 observations and 19 actions, found 60 "
        "observations and 19 actions; see docs/convert.md, 'Refused policies'\n"
    )
    assert not out.exists()


@pytest.mark.slow
def test_a_video_follows_the_robot(tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(driver, "write_video", lambda *arguments: shown.append(arguments))
    monkeypatch.setattr(driver, "check_video", lambda *_: None)
    options = Options(0.1, backend="analytic", video=True)
    driver.run(WalkTrial(WalkSettings(), options), tmp_path)
    ((folder, film, scenes),) = shown
    assert (folder.parent, scenes.camera) == (tmp_path, "track")
    assert len(film.poses) == 20
    # The path, and one more place where the robot was.
    assert len(scenes.marks(20)) == len(scenes.marks(1)) + 1


def test_the_experiments_pipeline_is_used_unless_the_command_names_passes(
    tmp_path, spikeport, monkeypatch
):
    asked = []

    def prepare(trial):
        asked.append(trial.options.pipeline)
        raise UsageError("seen")

    monkeypatch.setattr(driver, "prepare", prepare)
    run = ("run", "walk", "--seconds", "0.5")
    spikeport(*run, "--out", tmp_path / "a")
    spikeport(*run, "--passes", "as_written", "--out", tmp_path / "b")
    assert asked == ["compact", "as_written"]


def test_a_gait_is_recorded_once_for_a_policy(monkeypatch, tmp_path):
    recorded = []

    def record(policy, perturbations):
        recorded.append(policy)
        return np.full((2, 69), float(len(recorded)))

    monkeypatch.setattr(walk_trial, "record_gait", record)
    trial = WalkTrial(WalkSettings(), Options(1.0, cache=Cache(tmp_path / "cache")))
    weights = trial.settings.walking_policy()
    for _ in range(2):
        assert (trial._gait(weights) == 1).all()
    other = dataclasses.replace(weights, pose_rad=weights.pose_rad + 0.01)
    assert (trial._gait(other) == 2).all()
    rough = WalkTrial(WalkSettings(gait="rough"), trial.options)
    assert (rough._gait(weights) == 3).all()


@pytest.mark.filterwarnings("error::UserWarning")
def test_a_run_leaves_inputs_that_are_cut_off_to_its_report(monkeypatch, tmp_path):
    """Ranges of policies are quantiles of their values: all walks, and calibrations, would warn."""

    def prepare(_trial):
        warnings.warn("SP408 input saturation: observation (spikes lost in 5 %)", stacklevel=1)
        raise UsageError("prepared")

    monkeypatch.setattr(driver, "prepare", prepare)
    with pytest.raises(UsageError, match="prepared"):
        driver.run(WalkTrial(WalkSettings(), Options(1.0)), tmp_path)


def test_a_users_path_is_read_once(tmp_path):
    """The digest of a run is that of the path that the robot walks."""
    (path := tmp_path / "mine.csv").write_text("t_s,x_m,y_m\n0,0,0\n10,1,0\n")
    trial = WalkTrial(WalkSettings(path=str(path)), Options(5.0))
    trial.check()
    path.write_text("nonsense")
    assert trial.path.at(5.0)[0] == pytest.approx(0.5)
