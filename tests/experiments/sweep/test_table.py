"""The table of a sweep: every metric over the varied settings."""

import numpy as np
import pytest
import xarray as xr

from spikeport.errors import UsageError
from spikeport.experiments.sweep.folder import PointFiles, SweepFolder
from spikeport.experiments.sweep.table import table, write_table
from tests.helpers.sweeps import finish, result


def test_damaged_results_are_named_all_at_once(sweep_of, tmp_path):
    sweep = sweep_of()
    folder = SweepFolder(tmp_path)
    damaged = [folder.result_path(point) for point in sweep.points()[:2]]
    for point in sweep.points():
        finish(folder, point, falls=0)
    for path in damaged:
        path.write_text("{")
    with pytest.raises(UsageError) as caught:
        table(sweep, folder)
    assert str(caught.value).splitlines() == [
        f"{path}: holds no result; remove it to run its point again" for path in damaged
    ]


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
        assert read.attrs == {"experiment": "walk", "seconds": 2.0}  # backends are a dimension


def test_values_without_a_finished_point_are_in_the_table(sweep_of, tmp_path):
    sweep = sweep_of(varied={"calibrated": (False, True)})
    folder = SweepFolder(tmp_path)
    finish(folder, sweep.points()[0], falls=1)
    assert table(sweep, folder).falls.sel(calibrated="False", seed=0) == 1
    assert np.isnan(table(sweep, folder).falls.sel(calibrated="True", seed=0))


def test_the_seconds_of_a_table_are_those_of_its_points_and_not_the_allowed_ones(
    sweep_of, tmp_path
):
    asked = {"experiment": "switch", "seconds": 60.0, "settings": {}}
    sweep = sweep_of(**asked, varied={"schedule": ("switch", "free-standing")})
    folder = SweepFolder(tmp_path)
    for point in sweep.points():
        folder.write(point, PointFiles({**result(point, falls=0), "seconds": point.seconds}, None))
    made = table(sweep, folder)
    assert made.attrs["seconds"] == [26.0, 40.0]
    write_table(folder, made)
    with xr.open_dataset(folder.path / "table.nc", engine="h5netcdf") as read:
        assert read.attrs["seconds"].tolist() == [26.0, 40.0]
    sweep = sweep_of(**asked, varied={"schedule": ("switch",)})
    assert table(sweep, folder).attrs["seconds"] == 26.0
