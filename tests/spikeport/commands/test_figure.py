"""``spikeport figure``: the runs that it asks for; tests/experiments tests the runs themselves."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from spikeport.commands import figure, sweep
from spikeport.commands.options import RunOptions, Target, Workers
from spikeport.commands.options_of_experiments import SweepRequest
from spikeport.commands.run import RunRequest


@pytest.fixture
def asked(monkeypatch):
    """Return the requests that were passed on, of single runs and of sweeps."""
    requests = []
    monkeypatch.setattr(figure.run, "run", requests.append)
    monkeypatch.setattr(figure.sweep, "run", lambda request: requests.append(request) or 0)
    return requests


def test_figures_are_run_with_the_papers_settings(spikeport, asked):
    assert spikeport("figure", "reach").code == spikeport("figure", "draw").code == 0
    assert asked == [
        RunRequest(
            experiment="reach",
            target=Target(backend="native", chip="loihi", passes=None),
            options=RunOptions(seed=0, settings=["preset=paper"]),
        ),
        RunRequest(
            experiment="draw",
            target=Target(),
            options=RunOptions(settings=["preset=paper", "digit=5"]),
        ),
    ]


def test_the_users_options_replace_the_papers_settings(spikeport, asked, tmp_path):
    settings = ("--set", "digit=8", "--set", "m1=50")
    rest = ("--seconds", "6", "--seed", "3", "--backend", "reference", "--video", "--overwrite")
    assert spikeport("figure", "draw", *settings, *rest, "--out", tmp_path).code == 0
    (request,) = asked
    assert request.target == Target(backend="reference")
    assert request.options == RunOptions(
        seed=3,
        seconds=6.0,
        settings=["preset=paper", "digit=8", "m1=50"],
        out=Path(tmp_path),
        overwrite=True,
        video=True,
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--backend", "analytic"), "--backend analytic: has no neurons, which figure '5a' shows"),
        (("--seed", str(2**32 - 1)), "--seed 4294967295: the last of 5 runs has seed 4294967299"),
    ],
)
def test_a_backend_without_neurons_or_too_large_a_seed_is_refused_for_the_figure_of_walks(
    spikeport, asked, options, words
):
    refused = spikeport("figure", "5a", *options)
    assert refused.code == 2
    assert refused.err.startswith(f"error: {words}")
    assert not asked


def test_a_backend_without_neurons_is_refused_for_a_figure_of_neurons(spikeport, asked):
    assert spikeport("figure", "3", "--backend", "analytic") == (
        2,
        "",
        "error: --backend analytic: has no neurons, which figure '3' shows; cure: leave it out\n",
    )
    assert not asked


@pytest.mark.slow
@pytest.mark.usefixtures("with_kept")
def test_a_figure_leaves_the_folder_of_its_run(spikeport, tmp_path):
    out = tmp_path / "figure"
    options = ("--backend", "reference", "--seconds", "0.05", "--out", out)
    done = spikeport("figure", "reach", "--set", "preset=lean", *options)
    assert (done.code, done.err) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == ["figure.png", "probes.nc", "result.json"]


def test_the_figure_of_walks_is_a_sweep(spikeport, asked, tmp_path):
    assert spikeport("figure", "walk", "--seed", "3", "--out", tmp_path).code == 0
    (request,) = asked
    assert request == SweepRequest(
        experiment="walk",
        target=Target(),
        vary=["policy=mlp,spiking"],
        first_seed=3,
        n_seeds=5,
        seconds=None,
        settings=["path=loop", "n_neurons=20"],
        out=Path(tmp_path),
        workers=Workers(),
        probes=True,
        figure="spikeport.experiments.walk.trajectories",
    )


def test_the_sweep_of_walks_is_passed_its_scheduler_and_settings(spikeport, asked):
    where = ("--scheduler", "tcp://127.0.0.1:8786")
    options = ("--seconds", "20", "--set", "path=line")
    assert spikeport("figure", "walk-sweep", *where, *options).code == 0
    (request,) = asked
    assert request.workers == Workers(scheduler="tcp://127.0.0.1:8786")
    assert (request.seconds, request.probes) == (20.0, False)
    assert request.settings == ["calibrated=false", "path=line"]
    assert len(sweep.planned(request).points()) == 4 * 4 * 2 * 5


@pytest.mark.parametrize("option", [("--workers", "2"), ("--scheduler", "tcp://127.0.0.1:1")])
def test_workers_are_refused_for_the_figure_of_a_single_run(spikeport, asked, option):
    assert spikeport("figure", "reach", *option) == (
        2,
        "",
        "error: figure 'reach' is a single run; leave out --workers and --scheduler\n",
    )
    assert asked == []


@pytest.mark.parametrize("option", ["--video", "--overwrite", "--counts"])
def test_video_overwrite_and_counts_are_refused_for_the_figure_of_a_sweep(spikeport, asked, option):
    assert spikeport("figure", "walk", option) == (
        2,
        "",
        "error: figure 'walk' is a sweep, which goes on with what is in --out; leave out --video, "
        "--overwrite and --counts\n",
    )
    assert asked == []


@pytest.mark.parametrize(
    ("option", "name"),
    [
        (("--set", "n_neurons=6"), "--set n_neurons"),
        (("--backend", "native-threads"), "--backend"),
    ],
)
def test_a_value_of_a_setting_that_the_figure_varies_is_refused(spikeport, asked, option, name):
    assert spikeport("figure", "5b", *option) == (
        2,
        "",
        f"error: {name}: figure '5b' varies it; cure: leave it out\n",
    )
    assert asked == []


@pytest.mark.parametrize(
    "option",
    [
        ("--video",),
        ("--counts",),
        ("--seconds", "1"),
        ("--seed", "1"),
        ("--workers", "2"),
        ("--backend", "analytic"),
        ("--passes", "compact"),
    ],
)
def test_a_figure_without_a_run_takes_no_options_of_runs(spikeport, asked, option, tmp_path):
    assert spikeport("figure", "overview", *option, "--out", tmp_path / "out") == (
        2,
        "",
        "error: figure 'overview' is drawn without a run: it takes --set, --chip, --out and "
        "--overwrite; cure: leave the others out\n",
    )
    assert not (tmp_path / "out").exists()


def test_an_unknown_chip_of_a_figure_without_a_run_is_refused(spikeport, tmp_path):
    done = spikeport("figure", "overview", "--chip", "nonsense", "--out", tmp_path / "out")
    assert done.code == 2
    assert done.err.startswith("error: unknown chip 'nonsense'; choose from: ")
    assert not (tmp_path / "out").exists()


def test_the_backend_of_a_record_is_refused_for_a_figure(spikeport, asked):
    assert spikeport("figure", "reach", "--backend", "replay") == (
        2,
        "",
        "error: --backend replay: figures take no record of a run; cure: leave it out, or "
        "spikeport run with --backend replay --replay FILE\n",
    )
    assert asked == []


@pytest.mark.slow
@pytest.mark.usefixtures("with_kept")
def test_drawing_the_overview_gives_no_notice_of_the_build_timeout(
    spikeport, monkeypatch, tmp_path
):
    monkeypatch.setattr("spikeport.build_timer.NOTICE_S", 0.0)
    monkeypatch.setattr(
        "spikeport.experiments.switch.overview.overview_figure", lambda _network: Figure()
    )
    out = tmp_path / "out"
    done = spikeport("figure", "overview", "--set", "n_neurons=2", "--out", out)
    assert done == (0, f"written: {out}/ (figure.png)\n", "")


def test_an_unknown_figure_lists_the_known_ones(spikeport):
    assert spikeport("figure", "dance") == (
        2,
        "",
        "error: unknown figure 'dance'; choose from: 1, 2, 3, 4, 5a, 5b, 5c, 6, basal-ganglia, "
        "draw, overview, reach, teaser, walk, walk-silenced, walk-sweep\n",
    )


def test_the_papers_numbers_of_figures_stand_for_their_names(spikeport, asked):
    for figure_ in ("1", "teaser", "6", "basal-ganglia", "3", "reach", "5a", "walk"):
        assert spikeport("figure", figure_).code == 0
    assert asked[0] == asked[1] == asked[2] == asked[3]
    assert asked[0].experiment == "switch"
    assert asked[4] == asked[5]
    assert asked[6] == asked[7]
