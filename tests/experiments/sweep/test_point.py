"""Points of a sweep, which equal single runs whatever their worker ran before."""

import json

import pytest
import xarray as xr

from spikeport import cache
from spikeport.experiments import driver, registry
from spikeport.experiments.sweep import point as sweep_point
from spikeport.experiments.sweep.point import PointRun
from spikeport.reading.hdf5 import read_dataset

SAME = ("metrics", "activity", "image_digest", "resources", "energy", "seeds", "settings")


@pytest.fixture
def run(tmp_path, monkeypatch, kept):
    """Return a function that runs points as a worker does, and drop its network at the end."""
    monkeypatch.setenv(cache.FOLDER, str(kept.folder))
    worker = PointRun.new()
    yield lambda point: worker(point, str(tmp_path))
    sweep_point.KEEPER.drop()


@pytest.fixture
def prepared(monkeypatch):
    """Return the trials whose networks were made ready."""
    trials = []
    prepare = driver.prepare

    def counted(trial):
        trials.append(trial)
        return prepare(trial)

    monkeypatch.setattr(driver, "prepare", counted)
    return trials


SWEEPS = [
    ("reach", {"m1": 40, "cb": 30, "s1": 10}, {}, (1, 2)),
    ("draw", {"m1": 40, "cb": 30, "s1": 10, "recognise": False}, {"digit": (3, 7)}, (1,)),
    ("walk", {"n_neurons": 2, "follower": "exact"}, {"path": ("line", "s-curve")}, (1, 2)),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("experiment", "settings", "varied", "seeds"),
    SWEEPS,
    ids=[experiment for experiment, *_ in SWEEPS],
)
def test_points_of_a_network_equal_single_runs(
    run,
    prepared,
    sweep_of,
    short_gait,
    pocket,
    tmp_path,
    monkeypatch,
    experiment,
    settings,
    varied,
    seeds,
):
    monkeypatch.setattr(driver, "draw_scenes", lambda *_: ())
    settings = {"network_seed": 0, **settings}
    if experiment == "walk":
        settings["policy"] = pocket
    seconds = 4.0 if experiment == "draw" else 0.1  # which the region of a drawing depends on
    asked = {"experiment": experiment, "settings": settings, "varied": varied, "seconds": seconds}
    points = sweep_of(**asked, seeds=seeds).points()
    found = [run(point).result for point in points]
    assert len(prepared) == 1
    for point, result in list(zip(points, found, strict=True))[1:]:
        one = registry.get(experiment)
        one.run(one.settings(**point.settings), point.options, tmp_path / point.name)
        single = json.loads((tmp_path / point.name / "result.json").read_text())
        for figures in (result, single):
            del figures["metrics"]["real_time_factor"]
        assert {key: result[key] for key in SAME} == {key: single[key] for key in SAME}


@pytest.mark.slow
def test_time_series_of_a_point_are_kept_if_asked_for_and_are_those_of_a_single_run(
    run, sweep_of, tmp_path
):
    asked = {"experiment": "reach", "backend": "analytic", "pipeline": None, "seconds": 0.02}
    sweeps = [sweep_of(**asked, settings={}, varied={}, probes=keeps) for keeps in (True, False)]
    point, without = (sweep.points()[0] for sweep in sweeps)
    (tmp_path / "point.nc").write_bytes(run(point).probes)
    assert run(without).probes is None
    one = registry.get("reach")
    one.run(one.settings(**point.settings), point.options, tmp_path / "single")
    single = read_dataset(tmp_path / "single" / "probes.nc")
    assert single.qpos.shape == (4, 26)  # a page of a run shows the poses
    xr.testing.assert_identical(read_dataset(tmp_path / "point.nc"), single)
