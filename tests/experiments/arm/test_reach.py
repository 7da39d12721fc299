import errno
import os

import nengo
import numpy as np
import pytest
from PIL import Image

from spikeport import cache
from spikeport.cache import Cache
from spikeport.compile.pipeline import compile_network
from spikeport.digest import digest_of
from spikeport.errors import DivergedError, UsageError
from spikeport.experiments import driver
from spikeport.experiments.arm import reach, trial
from spikeport.experiments.arm.reach import ReachSettings, ReachTrial
from spikeport.experiments.arm.reach_task import BOXES, rehearsals
from spikeport.experiments.options import Options
from spikeport.find_network import find_network
from spikeport.networks.arm import PRESETS, ArmNetwork, ArmSizes, analytic_arm
from spikeport.robot.plant import Plant
from tests.helpers.results import RESULT_FIELDS
from tests.helpers.unwritten import outcome

ANALYTIC = ("run", "reach", "--backend", "analytic", "--seconds", "0.2")
FILES = ["figure.png", "probes.nc", "result.json"]


def reached(folder, seconds, **options):
    trial = ReachTrial(ReachSettings(), Options(seconds, backend="analytic", **options))
    return driver.run(trial, folder)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.slow
def test_a_cached_rehearsal_serves_controllers_with_other_neurons(tmp_path, monkeypatch):
    tour = rehearsals(BOXES["small"])[:1]
    monkeypatch.setattr(ReachTrial, "rehearsals", lambda _: tour)
    options = Options(1.0, cache=Cache(tmp_path))
    region = ReachTrial(ReachSettings(), options)._rehearsed()
    monkeypatch.setattr(trial, "record_region", None)
    again = ReachTrial(ReachSettings(network_seed=1, m1=40), options)._rehearsed()
    for name, array in region.arrays().items():
        np.testing.assert_array_equal(again.arrays()[name], array)


@pytest.mark.parametrize(
    ("settings", "options", "why"),
    [
        ({"box": "0:3,0:3,0:3"}, {}, "is out of reach of the right arm"),
        ({"calibrated": "absent.npz"}, {}, "absent.npz"),
        ({"calibrated": True}, {"backend": "analytic"}, "'analytic' has no neurons to calibrate"),
    ],
)
def test_check_refuses_settings_that_a_run_would_refuse(settings, options, why):
    with pytest.raises(UsageError, match=why):
        ReachTrial(ReachSettings(**settings), Options(1.0, **options)).check()


# quality of the reaching


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("box", "least"), [("small", 14), ("large", 11)])
def test_the_exact_law_reaches_with_every_seed(box, least, seed):
    options = Options(5.0, backend="analytic", seed=seed)
    metrics = outcome(ReachTrial(ReachSettings(box=box), options)).result["metrics"]
    assert metrics["reaches"] >= least
    assert metrics["torque_error_rms_nm"] == pytest.approx([0.0] * 4, abs=1e-12)


@pytest.mark.slow
def test_float_neurons_reach_nearly_as_often(kept):
    result = outcome(ReachTrial(ReachSettings(), Options(3.0, "reference", cache=kept))).result
    assert result["metrics"]["reaches"] >= 8
    assert result["image_digest"] is result["resources"] is result["metrics"]["readout_spikes"]


@pytest.mark.slow
def test_the_lean_controller_reaches_on_the_emulated_chip(kept):
    result = outcome(ReachTrial(ReachSettings(), Options(1.2, "nengo-loihi", cache=kept))).result
    assert result["metrics"]["reaches"] >= 2.7 * 1.2
    assert result["metrics"]["readout_spikes"] == 0


@pytest.mark.slow
def test_a_small_controller_reaches_three_targets_a_second_on_the_emulated_chip(loihi):
    figures = loihi.result["metrics"]
    assert figures["reaches"] >= 3
    assert figures["readout_spikes"] == 0
    assert len(figures["torque_error_rms_nm"]) == 4
    assert 0 < max(figures["torque_error_rms_nm"]) < 5


# network and settings


@pytest.fixture
def rehearsed(kept, monkeypatch):
    """Let networks that are found by name use the rehearsals of other tests."""
    monkeypatch.setenv(cache.FOLDER, str(kept.folder))


@pytest.mark.slow
@pytest.mark.usefixtures("rehearsed")
def test_the_built_in_network_gives_the_runs_image(loihi):
    image = compile_network(find_network("arm", ["m1=200"])).image
    assert loihi.result["image_digest"] == image.digest


@pytest.mark.slow
@pytest.mark.usefixtures("rehearsed")
def test_another_network_seed_gives_another_image(loihi):
    image = compile_network(find_network("arm", ["m1=200", "network_seed=1"])).image
    assert image.digest != loihi.result["image_digest"]


def test_settings_of_sizes_replace_those_of_the_preset():
    settings = ReachSettings(preset="paper", cb=30)
    assert settings.sizes == ArmSizes(m1=8000, cb=30, s1=50)
    assert ReachSettings().sizes == PRESETS["lean"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"box": "huge"},
            "unknown box 'huge'; choose from: large, small, x0:x1,y0:y1,z0:z1 (m)",
        ),
        ({"preset": "fat"}, "unknown preset 'fat'; choose from: lean, paper"),
        ({"cb": -5}, "cb=-5: the number of neurons must be at least 1"),
        ({"network_seed": 2**32}, "network_seed=4294967296: a seed must be from 0 to 4294967295"),
    ],
)
def test_a_wrong_setting_says_what_is_allowed(wrong, message):
    with pytest.raises(UsageError) as caught:
        ReachSettings(**wrong)
    assert str(caught.value) == message


# files of a run


@pytest.mark.slow
def test_the_result_has_every_field(loihi):
    result = loihi.result
    assert tuple(result) == RESULT_FIELDS
    assert result["command"] == ["spikeport", "run"]
    assert (result["experiment"], result["backend"]) == ("reach", "nengo-loihi")
    assert result["seconds"] == 1.0
    assert result["seeds"] == {"run": 0, "network": 0}
    assert result["settings"]["m1"] == 200
    assert result["energy"].keys() == result["timing"].keys() > set()


@pytest.mark.slow
def test_the_result_reads_back_as_it_was_returned(loihi):
    assert {**loihi.outcome.result, "command": ["spikeport", "run"]}.items() <= loihi.result.items()


@pytest.mark.slow
def test_the_resources_are_those_of_the_compiler(loihi):
    report = loihi.outcome.report.to_dict()
    assert loihi.result["resources"] == report["resources"]
    assert set(loihi.result["resources"]["cores"]) == {"used", "limit", "lower_bound"}
    assert loihi.result["resources"]["cores"]["used"] == len(report["cores"])


@pytest.mark.slow
def test_the_folder_holds_the_run_and_the_report(loihi):
    assert names(loihi.folder) == sorted([*FILES, "report.html", "report.json"])


@pytest.mark.slow
def test_the_figure_is_a_picture_of_sensible_size(loihi):
    with Image.open(loihi.folder / "figure.png") as figure:
        assert figure.format == "PNG"
        assert figure.size == (1320, 1100)
        assert len(figure.convert("RGB").getcolors(10**6)) > 50


@pytest.mark.slow
def test_two_runs_differ_in_wall_clock_time_only():
    trial = ReachTrial(ReachSettings(), Options(0.2, backend="analytic", seed=3))
    from_seed = [outcome(trial).result for _ in range(2)]
    for result in from_seed:
        del result["metrics"]["real_time_factor"]
    assert from_seed[0] == from_seed[1]


# divergence


def failing_arm(value):
    """Return a builder of a controller whose torque is the infinite ``value`` after 50 ms.

    The torque becomes infinite in a sum: Nengo itself refuses a node with an infinite output.
    """

    def build(_law):
        net = ArmNetwork(label="failing arm")
        with net:
            net.state, net.target = nengo.Node(size_in=11), nengo.Node(size_in=3)
            net.torque = nengo.Node(size_in=4)
            half = nengo.Node(lambda t: np.full(4, 1e308 if t > 0.05 else 0.0))
            for _ in range(2):
                nengo.Connection(half, net.torque, transform=np.sign(value), synapse=None)
            net.rasters, net.groups = {}, {}
        return net

    return build


@pytest.mark.filterwarnings("ignore:overflow")
@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_an_infinite_torque_ends_the_run_and_leaves_the_last_states(
    tmp_path, spikeport, monkeypatch, value
):
    out = tmp_path / "run"
    monkeypatch.setattr(trial, "analytic_arm", failing_arm(value))
    code, printed, error = spikeport(*ANALYTIC, "--out", out)
    assert (code, printed) == (1, "")
    assert error == (
        "error: the controller's torque in N m is not finite at 0.050 s: value 0 of 4, counted "
        f"from 0, is {value}; cure: look at its inputs in the last states; "
        f"the last states are in {out}/last_states.npz\n"
    )
    assert names(out) == ["last_states.npz"]
    with np.load(out / "last_states.npz") as states:
        assert states["time_s"] == pytest.approx(np.arange(11) * 0.005)
        assert all(np.isfinite(states[name]).all() for name in states.files)


def test_a_law_that_gives_nan_ends_the_run_and_leaves_the_last_states(
    tmp_path, spikeport, monkeypatch
):
    def nan_arm(law):
        net = analytic_arm(law)
        (node,) = (n for n in net.nodes if n.label == "law")
        exact = node.output
        node.output = lambda t, x: exact(t, x) if t < 0.05 else np.full(4, np.nan)
        return net

    out = tmp_path / "run"
    monkeypatch.setattr(trial, "analytic_arm", nan_arm)
    code, printed, error = spikeport(*ANALYTIC, "--out", out)
    assert (code, printed) == (1, "")
    assert error.startswith("error: Function '")
    assert error.endswith(
        f"returned non-finite value; the last states are in {out}/last_states.npz\n"
    )
    assert names(out) == ["last_states.npz"]


def test_a_robot_out_of_range_ends_the_run_and_leaves_the_last_states(
    tmp_path, spikeport, monkeypatch
):
    out = tmp_path / "run"
    step = Plant.step

    def thrown(plant):
        if plant.time_s > 0.02:
            plant.data.qvel[-1] = 1e4
        step(plant)

    # The run has only one plant to throw, since the exact controller needs none of its own.
    monkeypatch.setattr(Plant, "step", thrown)
    code, _, error = spikeport(*ANALYTIC, "--out", out)
    assert code == 1
    assert error.startswith("error: the simulation diverged at 0.03")
    assert error.endswith(f"; the last states are in {out}/last_states.npz\n")
    assert names(out) == ["last_states.npz"]
    with np.load(out / "last_states.npz") as states:
        assert set(states.files) == {"time_s", "qpos", "qvel", "ctrl"}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:overflow")
def test_divergence_replaces_an_earlier_run(tmp_path, monkeypatch):
    reached(tmp_path, 0.1)
    assert names(tmp_path) == FILES
    monkeypatch.setattr(trial, "analytic_arm", failing_arm(np.inf))
    with pytest.raises(DivergedError):
        reached(tmp_path, 0.1)
    assert names(tmp_path) == ["last_states.npz"]


@pytest.mark.slow
@pytest.mark.parametrize(("module", "failing"), [(reach, "reach_figure"), (trial, "dataset")])
def test_a_failure_while_writing_leaves_no_result(tmp_path, monkeypatch, module, failing):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(module, failing, full)
    with pytest.raises(OSError, match="No space left"):
        reached(tmp_path, 0.05)
    assert names(tmp_path) == []


# refusals


@pytest.mark.slow
def test_a_box_out_of_reach_is_refused_before_the_run(tmp_path, spikeport):
    out = tmp_path / "run"
    code, printed, error = spikeport(
        *ANALYTIC, "--set", "box=0.3:0.9,-0.3:-0.1,1.1:1.3", "--out", out
    )
    assert (code, printed) == (2, "")
    assert error == (
        "error: box 0.3:0.9,-0.3:-0.1,1.1:1.3: (0.557, -0.300, 1.100) m is out of reach of the "
        "right arm, by 6.6 cm; the nearest point inside is (0.505, -0.291, 1.139) m; cure: move "
        "the goal there, or make it smaller\n"
    )
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    "box", ["-0.17:0.454,-0.33:0.015,1.343:1.667", "-0.04:0.13,-0.38:-0.03,1.36:1.94"]
)
def test_a_box_around_a_place_out_of_reach_is_refused(box):
    with pytest.raises(UsageError, match="is out of reach of the right arm, by"):
        ReachTrial(ReachSettings(box=box), Options(1.0, backend="analytic")).check()


# absent packages and graphics


def test_a_video_that_cannot_be_made_is_refused_before_the_run(tmp_path, spikeport, monkeypatch):
    from spikeport.robot import video

    monkeypatch.setattr(video, "find_spec", lambda name: None)
    out = tmp_path / "run"
    code, _, error = spikeport(*ANALYTIC, "--out", out, "--video")
    assert code == 2
    assert error == (
        "error: a video needs the package imageio-ffmpeg, which is absent; "
        "install it with: pip install 'spikeport[video]'\n"
    )
    assert not out.exists()


@pytest.mark.slow
def test_a_run_without_graphics_still_has_a_figure(tmp_path, monkeypatch):
    from spikeport.errors import RenderError
    from spikeport.experiments import pictures

    def no_graphics(*_):
        raise RenderError("none")

    monkeypatch.setattr(pictures, "Renderer", no_graphics)
    reached(tmp_path, 0.05)
    assert names(tmp_path) == FILES


def test_the_exact_controller_is_one_step_late(law):
    with nengo.Network() as net:
        controller = analytic_arm(law)
        shown = nengo.Node(np.r_[law.gains.rest_rad, np.zeros(4), 0.3, -0.2, 1.2, 0.3, -0.2, 1.2])
        nengo.Connection(shown[:11], controller.state, synapse=None)
        nengo.Connection(shown[11:], controller.target, synapse=None)
        probe = nengo.Probe(controller.torque)
    with nengo.Simulator(net, progress_bar=False) as sim:
        sim.run_steps(3)
    exact = law.torque(np.array(law.gains.rest_rad), np.zeros(4), np.zeros(3))
    assert sim.data[probe][0].tolist() == [0.0] * 4
    assert sim.data[probe][2] == pytest.approx(exact)


def test_the_values_of_a_box_do_not_depend_on_how_it_is_typed():
    def values(box):
        return ReachTrial(ReachSettings(box=box), Options(1.0)).rehearsed_values

    typed = "0.28:0.42,-0.34:-0.06,1.12:1.36", "0.280:0.42,-0.34:-0.060,1.12:1.36"
    assert values("small") == values(typed[0]) == values(typed[1]) != values("large")
    assert len({digest_of(values(box)) for box in ("small", *typed)}) == 1
