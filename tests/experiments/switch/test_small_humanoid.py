"""A small humanoid from the command line: calibrations, conversions and backends."""

import json

import pytest
import xarray as xr
from matplotlib.figure import Figure

from spikeport import cache
from spikeport.experiments import driver
from spikeport.experiments.arm.reach_task import rehearsals
from spikeport.experiments.switch import rehearsal
from spikeport.experiments.switch.trial import SwitchTrial
from spikeport.networks.arm import PRESETS, ArmSizes


@pytest.fixture
def short(tmp_path, phases):
    """Return the file of a schedule of half a second or so."""
    path = tmp_path / "short.toml"
    path.write_text(phases((0.1, 'path = "line"'), (0.5, 'arm = "reach"')))
    return path


@pytest.fixture
def small(monkeypatch, spikeport, short, short_gait, pocket, tmp_path):
    """Return a function that runs ``switch`` with few neurons and short rehearsals."""
    monkeypatch.setitem(PRESETS, "lean", ArmSizes(m1=60, cb=40, s1=10))
    monkeypatch.setattr(rehearsal, "SEEDS", (1000,))
    monkeypatch.setattr(driver, "draw_scenes", lambda *_: ())
    monkeypatch.setattr(
        rehearsal, "rehearsals", lambda box: [rehearsals(box)[1]._replace(seconds=3.0)]
    )

    def command(name, out, *settings, backend="native"):
        chosen = (f"schedule={short}", "n_neurons=2", f"policy={pocket}", *settings)
        given = [part for setting in chosen for part in ("--set", setting)]
        return spikeport(name, "switch", "--backend", backend, *given, "--out", tmp_path / out)

    return command


@pytest.fixture(scope="module")
def folder_of_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def kept(monkeypatch, folder_of_cache):
    """Keep rehearsals and compiles for the tests of this file that need none of their own."""
    monkeypatch.setenv(cache.FOLDER, str(folder_of_cache))


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out the figure of runs in tests that make many; other tests of this file draw it."""
    monkeypatch.setattr(SwitchTrial, "figure", lambda *_: Figure())


def result(folder):
    found = json.loads((folder / "result.json").read_text())
    del found["metrics"]["real_time_factor"]
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_calibration_is_made_once_and_used_again(small, tmp_path):
    file = tmp_path / "c.npz"
    code, printed, _ = small("calibrate", "c.npz")
    assert (code, printed.splitlines()[-1]) == (0, f"written: {file}")
    given = {"nominal": "false", "made": "true", "read": file}
    for name, calibrated in given.items():
        assert small("run", name, f"calibrated={calibrated}")[0] == 0
    nominal, made, read = (result(tmp_path / name) for name in given)
    assert made["image_digest"] == read["image_digest"] != nominal["image_digest"]
    assert made["metrics"] == read["metrics"]
    message = (
        f"error: calibrated={file}: made for anchor=True, but the run has anchor=False; make it "
        "with `spikeport calibrate`, the settings of the run, and --out\n"
    )
    assert small("run", "other", f"calibrated={file}", "anchor=false") == (2, "", message)
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("kept", "undrawn")
def test_conversions_give_humanoids_of_different_images_whose_readouts_do_not_spike(
    small, tmp_path
):
    digests = set()
    for name, chosen in {"paper": (), "layer": ("solve=layer",), "if": ("units=if",)}.items():
        assert small("run", name, *chosen)[0] == 0
        found = result(tmp_path / name)
        assert found["metrics"]["readout_spikes"] == 0
        digests.add(found["image_digest"])
    assert len(digests) == 3


@pytest.mark.slow
@pytest.mark.usefixtures("kept")
def test_the_emulator_does_what_the_native_backend_does(small, tmp_path):
    for backend in ("native", "nengo-loihi"):
        assert small("run", backend, backend=backend)[0] == 0
    native, emulated = (result(tmp_path / backend) for backend in ("native", "nengo-loihi"))
    for key in ("metrics", "image_digest", "resources", "energy"):
        assert native[key] == emulated[key]


@pytest.mark.slow
@pytest.mark.usefixtures("kept")
def test_a_board_does_what_the_native_backend_does(small, tmp_path):
    folders = [tmp_path / backend for backend in ("native", "board")]
    for folder in folders:
        assert small("run", folder.name, backend=folder.name)[0] == 0
    native, board = map(result, folders)
    for key in ("metrics", "image_digest", "resources", "energy", "activity"):
        assert native[key] == board[key]
    one, other = (xr.open_dataset(folder / "probes.nc") for folder in folders)
    assert one.identical(other)
    assert (board["link"]["steps"], board["link"]["held"]) == (600, 0)


@pytest.mark.slow
@pytest.mark.usefixtures("kept")
def test_a_humanoid_runs_in_float(small, tmp_path):
    assert small("run", "run", backend="reference")[0] == 0
    found = result(tmp_path / "run")
    assert (found["image_digest"], found["resources"]) == (None, None)
    assert (found["metrics"]["falls"], found["metrics"]["readout_spikes"]) == (0, None)
    assert found["metrics"]["spikes_by_nucleus"]["strD1"] > 0
