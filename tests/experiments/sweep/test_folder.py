"""What a sweep leaves in its folder, and which folders it refuses."""

import json

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.sweep.folder import open_folder
from spikeport.experiments.sweep.table import table
from tests.helpers.sweeps import VARIED, finish


def test_a_point_is_finished_once_its_result_is_there(sweep_of, tmp_path):
    sweep = sweep_of(probes=True)
    folder = open_folder(tmp_path / "sweep", sweep)
    first, second = sweep.points()
    finish(folder, first, b"series", falls=0)
    folder = open_folder(tmp_path / "sweep", sweep)
    assert (folder.holds(first), folder.holds(second)) == (True, False)
    assert folder.read(first) == {"metrics": {"falls": 0}}
    assert folder.probes_path(first).read_bytes() == b"series"
    assert json.loads(folder.plan.read_text())["varied"] == {"n_neurons": [2, 20]}


def test_a_folder_with_points_of_another_sweep_is_refused(sweep_of, tmp_path):
    folder = open_folder(tmp_path, sweep_of())
    finish(folder, sweep_of().points()[0], falls=0)
    with pytest.raises(UsageError) as caught:
        open_folder(tmp_path, sweep_of(varied={"n_neurons": (2, 10)}))
    assert str(caught.value) == (
        f'{tmp_path}: holds a sweep with varied={{"n_neurons": [2, 20]}}, but this one has '
        '{"n_neurons": [2, 10]}; ask for the same, or choose another --out'
    )


def test_a_folder_without_points_takes_any_sweep(sweep_of, tmp_path):
    open_folder(tmp_path, sweep_of())
    folder = open_folder(tmp_path, sweep_of(seconds=3.0))
    assert json.loads(folder.plan.read_text())["seconds"] == 3.0


def test_a_folder_with_anything_else_is_refused(sweep_of, tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(UsageError) as caught:
        open_folder(tmp_path, sweep_of())
    assert str(caught.value) == (
        f"{tmp_path}: holds something else than a sweep; choose another --out"
    )


def test_a_folder_that_cannot_be_made_is_refused(sweep_of, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(UsageError) as caught:
        open_folder(tmp_path / "file", sweep_of())
    assert str(caught.value) == f"{tmp_path}/file: cannot be made (File exists)"


@pytest.fixture
def finished(sweep_of, tmp_path):
    """A sweep of which one point of eight failed, its folder and its table."""
    sweep = sweep_of(varied=VARIED, seeds=(3, 4))
    folder = open_folder(tmp_path, sweep)
    for point in sweep.points()[:-1]:
        error = point.place["n_neurons"] + 0.1 * point.place["seed"]
        metrics = {"path_mse_m2": error, "cross_track_rms_m": 0.1, "falls": 0}
        finish(folder, point, **metrics, fallen_at_s=None, rates=[1.0])
    return sweep, folder, table(sweep, folder)
