import json

import pytest
import xarray as xr
from PIL import Image

from spikeport.cache import NOTHING
from spikeport.errors import MissingExtraError, UsageError
from spikeport.experiments import driver
from spikeport.experiments.arm import digit_reader, draw
from spikeport.experiments.options import Options
from tests.helpers.unwritten import outcome

FILES = ["figure.png", "probes.nc", "result.json"]


def trial(seconds=12.0, backend="analytic", cache=NOTHING, **settings):
    options = Options(seconds, backend=backend, cache=cache)
    return draw.DrawTrial(draw.DrawSettings(**settings), options)


@pytest.fixture(scope="module")
def five(tmp_path_factory):
    """Return the folder of a hasty 5, drawn by the exact law."""
    folder = tmp_path_factory.mktemp("five")
    driver.run(trial(6.0), folder)
    return folder


# quality of the drawing


@pytest.mark.slow
@pytest.mark.parametrize("digit", [1, 4, 8])
def test_the_exact_law_draws_straight_lines_corners_and_curves(digit):
    metrics = outcome(trial(digit=digit)).result["metrics"]
    assert metrics["shape_error_rms_m"] <= 0.002
    assert metrics["recognised_as"] == digit
    assert metrics["joint_limit_steps"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("digit", range(10))
def test_the_lean_controller_draws_every_digit_on_the_chip(kept, digit):
    metrics = outcome(trial(backend="native", cache=kept, digit=digit)).result["metrics"]
    assert metrics["shape_error_rms_m"] <= 0.005
    assert metrics["recognised_as"] == digit
    assert metrics["readout_spikes"] == metrics["joint_limit_steps"] == 0


@pytest.mark.slow
def test_float_neurons_draw():
    metrics = outcome(trial(6.0, backend="reference")).result["metrics"]
    assert metrics["shape_error_rms_m"] <= 0.006
    assert metrics["recognised_as"] == 5


# files of a run


@pytest.mark.slow
def test_a_hasty_drawing_by_the_exact_law_is_legible(five):
    metrics = json.loads((five / "result.json").read_text())["metrics"]
    assert metrics["shape_error_rms_m"] < 0.005
    assert metrics["shape_error_rms_m"] < metrics["tracking_error_rms_m"] < 0.06
    assert 0.1 < metrics["lag_s"] < 0.3
    assert metrics["recognised_as"] == 5
    assert metrics["torque_error_rms_nm"] == pytest.approx([0.0] * 4, abs=1e-12)


@pytest.mark.slow
def test_the_result_has_settings_and_metrics(five):
    result = json.loads((five / "result.json").read_text())
    assert (result["experiment"], result["settings"]["digit"]) == ("draw", 5)
    assert list(result["metrics"]) == [
        *("shape_error_rms_m", "shape_error_max_m", "tracking_error_rms_m", "lag_s"),
        *("recognised_as", "torque_error_rms_nm", "joint_limit_steps", "readout_spikes"),
        "real_time_factor",
    ]


@pytest.mark.slow
def test_the_folder_has_a_figure_and_the_whole_path(five):
    assert sorted(path.name for path in five.iterdir()) == FILES
    with Image.open(five / "figure.png") as figure:
        assert figure.size == (1320, 990)
    with xr.open_dataset(five / "probes.nc", engine="h5netcdf") as probes:
        assert probes.sizes["time"] == 1200
        assert float(probes.target.sel(axis="x")[-1]) == 0.35


@pytest.mark.slow
def test_a_drawing_is_not_recognised_without_the_readers_package(monkeypatch):
    monkeypatch.setattr(digit_reader, "find_spec", lambda name: None)
    assert outcome(trial(4.0)).result["metrics"]["recognised_as"] is None


@pytest.mark.parametrize(
    ("asked", "there", "reads"), [(None, True, True), (None, False, False), (False, True, False)]
)
def test_a_drawing_is_read_if_the_reader_is_installed_and_recognise_is_not_false(
    monkeypatch, asked, there, reads
):
    monkeypatch.setattr(digit_reader, "can_read", lambda: there)
    assert trial(recognise=asked)._reads is reads


# refusals


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"digit": 10}, "unknown digit '10'; choose from: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9"),
        ({"width_m": 0.0}, "width_m=0: a size must be above 0 and at most 3 m"),
        ({"height_m": float("nan")}, "height_m=nan: a size must be above 0 and at most 3 m"),
        ({"height_m": 1e300}, "height_m=1e+300: a size must be above 0 and at most 3 m"),
        ({"x_m": float("inf")}, "x_m=inf: a place must be from -3 to 3 m"),
        ({"preset": "fat"}, "unknown preset 'fat'; choose from: lean, paper"),
    ],
)
def test_a_wrong_setting_says_what_is_allowed(wrong, message):
    with pytest.raises(UsageError) as caught:
        draw.DrawSettings(**wrong)
    assert str(caught.value) == message


def test_recognise_is_refused_without_the_readers_package(monkeypatch):
    monkeypatch.setattr(digit_reader, "find_spec", lambda name: None)
    assert draw.DrawSettings().recognise is None
    with pytest.raises(MissingExtraError, match=r"pip install 'spikeport\[digits\]'$"):
        draw.DrawSettings(recognise=True)


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["analytic", "native"])
def test_a_sheet_out_of_reach_is_refused_before_the_run(tmp_path, spikeport, backend):
    out = tmp_path / "run"
    place = ("--set", "x_m=0.7", "--backend", backend)
    code, printed, error = spikeport("run", "draw", *place, "--out", out)
    assert (code, printed) == (2, "")
    assert error == (
        "error: digit 5: (0.700, -0.259, 1.340) m is out of reach of the right arm, by 8.8 cm; the "
        "nearest point inside is (0.615, -0.252, 1.361) m; cure: move the goal there, or make it "
        "smaller\n"
    )
    assert not out.exists()


def test_a_time_too_short_to_draw_in_is_refused(tmp_path, spikeport):
    code, _, error = spikeport("run", "draw", "--seconds", "3", "--out", tmp_path / "run")
    assert code == 2
    assert error.startswith("error: --seconds 3: draw simulates at least 4 s, and at most ")
