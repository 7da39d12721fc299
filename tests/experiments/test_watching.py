"""A run answers its viewers, and leaves none of their files."""

import threading

import xarray as xr

from spikeport.experiments import run_folder, watching
from spikeport.reading.hdf5 import read_dataset


def series(end):
    return xr.Dataset({"probe": ("time", [1.0] * end)}, {"time": [0.001 * i for i in range(end)]})


def test_a_run_that_nobody_watches_makes_no_series(tmp_path):
    def never():
        raise AssertionError

    watching.answer(tmp_path, never)
    assert not any(tmp_path.iterdir())


def test_a_viewer_gets_the_series_so_far_while_a_run_goes_on(tmp_path):
    with run_folder.opened(tmp_path / "run", "reach") as folder:
        assert watching.goes_on(folder)
        assert not watching.ask(folder, wait_s=0)
        found = []
        viewer = threading.Thread(target=lambda: found.append(watching.ask(folder, wait_s=60)))
        viewer.start()
        while viewer.is_alive():
            watching.answer(folder, lambda: series(7))
        assert found == [True]
        assert read_dataset(folder / run_folder.SO_FAR).sizes["time"] == 7
        watching.ask(folder, wait_s=0)
        run_folder.write_result(folder, {})
    assert not watching.goes_on(folder)
    assert [path.name for path in folder.iterdir()] == ["result.json"]
