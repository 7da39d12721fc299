"""What a sweep runs, what it leaves, and its table and figures; its workers: test_sweep_run."""

import json

import numpy as np
import pytest
import xarray as xr

from spikeport.errors import UsageError
from spikeport.experiments.sweep import figure as sweep_figure
from spikeport.experiments.sweep.folder import PointFiles, open_folder
from spikeport.experiments.sweep.table import table, write_table
from spikeport.experiments.walk import sweep_figure as walk_sweep_figure
from spikeport.experiments.walk import trajectories as walk_trajectories

VARIED = {"n_neurons": (2, 20), "backend": ("reference", "native")}


def finish(folder, point, probes=None, **metrics):
    folder.write(point, PointFiles({"metrics": metrics}, probes))


# what it runs


def test_the_points_are_all_combinations_seed_by_seed(sweep_of):
    points = sweep_of(varied=VARIED, seeds=(3, 4)).points()
    assert [tuple(point.place.values()) for point in points] == [
        (n, backend, seed) for seed in (3, 4) for n in (2, 20) for backend in VARIED["backend"]
    ]


def test_a_point_has_its_own_settings_and_the_sweeps(sweep_of):
    point = sweep_of(varied=VARIED, seeds=(3,)).points()[0]
    assert point.settings == {"network_seed": 3, "path": "paper", "n_neurons": 2}
    options = point.options
    assert (options.seconds, options.seed) == (2.0, 3)
    assert (options.backend, options.chip, options.pipeline) == ("reference", "loihi", "compact")


@pytest.mark.parametrize(
    "given", [{"settings": {"network_seed": 7}}, {"varied": {"network_seed": (7,)}}]
)
def test_a_network_seed_that_is_given_stays(sweep_of, given):
    (point,) = sweep_of(**{"varied": {}, "seeds": (3,), **given}).points()
    assert (point.settings["network_seed"], point.place["seed"]) == (7, 3)


def test_a_points_name_is_a_files_name(sweep_of):
    (point,) = sweep_of(varied={"path": ("a/b,c.csv",), "tau_fwd": (0.002,)}).points()
    assert point.name == "path=a%2Fb%2Cc.csv,tau_fwd=0.002,seed=0"


# what it leaves


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


def test_a_damaged_result_is_named(sweep_of, tmp_path):
    sweep = sweep_of()
    folder = open_folder(tmp_path, sweep)
    finish(folder, sweep.points()[0], falls=0)
    path = folder.result_path(sweep.points()[0])
    path.write_text("{")
    with pytest.raises(UsageError) as caught:
        table(sweep, folder)
    assert str(caught.value) == f"{path}: holds no result; remove it to run its point again"


# table and figure


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


def test_the_table_has_every_number_where_it_belongs(finished):
    _sweep, folder, made = finished
    write_table(folder, made)
    with xr.open_dataset(folder.path / "table.nc", engine="h5netcdf") as read:
        assert dict(read.sizes) == {"n_neurons": 2, "backend": 2, "seed": 2}
        assert set(read.data_vars) == {"path_mse_m2", "cross_track_rms_m", "falls", "fallen_at_s"}
        at = read.path_mse_m2.sel(n_neurons=20)
        assert at.sel(backend="reference").values.tolist() == pytest.approx([20.3, 20.4])
        assert np.isnan(at.sel(backend="native", seed=4))
        assert np.isnan(read.fallen_at_s).all()
        assert read.attrs == {"experiment": "walk", "backend": "native", "seconds": 2.0}


def test_values_of_which_no_point_finished_are_in_the_table(sweep_of, tmp_path):
    sweep = sweep_of(varied={"calibrated": (False, True)})
    folder = open_folder(tmp_path, sweep)
    finish(folder, sweep.points()[0], falls=1)
    assert table(sweep, folder).falls.sel(calibrated="False", seed=0) == 1
    assert np.isnan(table(sweep, folder).falls.sel(calibrated="True", seed=0))


def test_the_figure_shows_means_over_the_seeds(finished):
    sweep, folder, made = finished
    drawn = walk_sweep_figure.figure(sweep, folder, made)
    assert [axes.get_ylabel() for axes in drawn.axes] == [
        "path_mse_m2",
        "cross_track_rms_m",
        "falls",
    ]
    assert drawn.axes[-1].get_xlabel() == "n_neurons"
    first, second = drawn.axes[0].lines
    assert first.get_xydata().tolist() == [[2, pytest.approx(2.35)], [20, pytest.approx(20.35)]]
    assert second.get_ydata()[1] == pytest.approx(20.3)  # of the seed that finished
    assert [text.get_text() for text in drawn.axes[0].get_legend().get_texts()] == [
        "reference",
        "native",
    ]
    drawn.savefig(folder.path / "figure.png")


def test_further_settings_are_columns_and_texts_are_named(sweep_of, tmp_path):
    varied = {"policy": ("mlp", "spiking"), "speed": (0.4, 0.5), "backend": ("reference", "native")}
    sweep = sweep_of(varied=varied)
    folder = open_folder(tmp_path, sweep)
    for point in sweep.points():
        finish(folder, point, falls=0)
    drawn = sweep_figure.figure(sweep, folder, table(sweep, folder))
    assert [axes.get_title() for axes in drawn.axes] == ["backend=reference", "backend=native"]
    assert [label.get_text() for label in drawn.axes[0].get_xticklabels()] == ["mlp", "spiking"]
    assert [line.get_label() for line in drawn.axes[1].lines] == ["0.4", "0.5"]


def test_a_sweep_over_seeds_alone_is_drawn_over_them(sweep_of, tmp_path):
    sweep = sweep_of(varied={}, seeds=(0, 1))
    folder = open_folder(tmp_path, sweep)
    for point, error in zip(sweep.points(), (0.1, 30.0), strict=True):
        finish(folder, point, path_mse_m2=error)
    (axes,) = sweep_figure.figure(sweep, folder, table(sweep, folder)).axes
    assert axes.lines[0].get_xydata().tolist() == [[0, 0.1], [1, 30.0]]
    assert axes.get_yscale() == "log"


def test_trajectories_are_drawn_over_the_ideal_path(sweep_of, tmp_path):
    sweep = sweep_of(varied={"policy": ("mlp", "spiking")}, seeds=(0, 1), probes=True)
    folder = open_folder(tmp_path / "sweep", sweep)
    for point in sweep.points():
        finish(
            folder, point, _probes(tmp_path, point), cross_track_rms_m=0.02, falls=point[1]["seed"]
        )
    drawn = walk_trajectories.figure(sweep, folder, table(sweep, folder))
    (axes,) = drawn.axes
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["ideal path", "reference policy", "spiking policy", "fell"]
    traces = [line.get_xydata()[-1].tolist() for line in axes.lines if len(line.get_xdata()) == 2]
    assert traces == [[1, 0], [1, 0], [1, 1], [1, 1]]
    assert drawn.get_suptitle() == (
        "walk on native, 2 s, seeds: 2\n"
        "median distance from the path (rms): reference policy 2.0 cm, spiking policy 2.0 cm"
    )


def _probes(folder, point):
    """Two steps ahead, as the recording of a walk has them."""
    state = ("time", "turned"), [[0.0, 0.0], [1.0, point.place["seed"]]]
    probes = xr.Dataset({"state": state}, {"turned": ["x", "y"]})
    probes.to_netcdf(folder / "probes.nc", engine="h5netcdf")
    return (folder / "probes.nc").read_bytes()
