"""Trajectories of a sweep of the walk, over the ideal path."""

import numpy as np
import pytest
import xarray as xr

from spikeport.errors import UsageError
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.table import table
from spikeport.experiments.walk import trajectories as walk_trajectories
from spikeport.experiments.walk.port import LEAD_S
from tests.helpers.sweeps import finish


def test_trajectories_are_drawn_over_the_ideal_path(sweep_of, tmp_path):
    sweep = sweep_of(varied={"policy": ("mlp", "spiking")}, seeds=(0, 1), probes=True)
    folder = SweepFolder(tmp_path / "sweep")
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


def test_the_ideal_path_ends_where_the_reference_does(sweep_of, tmp_path):
    sweep = sweep_of(varied={"policy": ("mlp",)}, settings={"path": "line", "ramp": 2.0})
    folder, (point,) = SweepFolder(tmp_path / "sweep"), sweep.points()
    finish(folder, point, _probes(tmp_path, point), cross_track_rms_m=0.02, falls=0)
    (axes,) = walk_trajectories.figure(sweep, folder, table(sweep, folder)).axes
    # 2 s and the lead, half of the ramp late, at 0.5 m/s
    assert axes.lines[0].get_xdata()[-1] == pytest.approx(0.5 * (2.0 + LEAD_S - 1.0), abs=0.03)


def _altered(state, dimensions=("time", "turned"), name="state"):
    return xr.Dataset({name: (dimensions, state)}, {dimensions[-1]: ["x", "y"]})


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (None, "no such file"),
        (b"", "signature"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "expected a whole HDF5 file"),
        (_altered(np.zeros((2, 2)), name="speed"), "no attribute 'state'"),
        (_altered(np.zeros((2, 2)), ("time", "joint")), "turned"),
        (_altered(np.zeros((0, 2))), "out of bounds"),
        (_altered(np.array([["a", "b"]])), "could not convert string to float"),
    ],
)
def test_the_error_of_altered_time_series_names_their_file(sweep_of, tmp_path, content, reason):
    sweep = sweep_of(varied={"policy": ("mlp",)}, seeds=(0,), probes=True)
    folder, (point,) = SweepFolder(tmp_path / "sweep"), sweep.points()
    if isinstance(content, xr.Dataset):
        content.to_netcdf(tmp_path / "probes.nc", engine="h5netcdf")
        content = (tmp_path / "probes.nc").read_bytes()
    finish(folder, point, content, cross_track_rms_m=0.02, falls=0)
    with pytest.raises(UsageError) as caught:
        walk_trajectories.figure(sweep, folder, table(sweep, folder))
    message = str(caught.value)
    assert message.startswith(f"{folder.probes_path(point)}: holds no time series of a walk (")
    assert reason in message
    assert message.endswith(f"; remove {folder.result_path(point)} to run its point again")


def _probes(folder, point):
    """Return the file of a walk of two steps, the second one 1 m ahead."""
    state = ("time", "turned"), [[0.0, 0.0], [1.0, point.place["seed"]]]
    probes = xr.Dataset({"state": state}, {"turned": ["x", "y"]})
    probes.to_netcdf(folder / "probes.nc", engine="h5netcdf")
    return (folder / "probes.nc").read_bytes()
