"""``spikeport figure``: which run it asks for; the runs are tested in tests/experiments."""

from pathlib import Path

import pytest

from spikeport.commands import figure
from spikeport.commands.run import Request


@pytest.fixture
def asked(monkeypatch):
    """The requests that were passed on."""
    requests = []
    monkeypatch.setattr(figure, "run", requests.append)
    return requests


def test_the_figures_have_the_papers_settings(spikeport, asked):
    assert spikeport("figure", "reach").code == spikeport("figure", "draw").code == 0
    assert asked == [
        Request("reach", "native", "loihi", None, 0, 15.0, ["preset=paper"], None, False, False),
        Request(
            "draw",
            "native",
            "loihi",
            None,
            0,
            12.0,
            ["preset=paper", "digit=5"],
            None,
            False,
            False,
        ),
    ]


def test_what_is_asked_for_replaces_the_papers_settings(spikeport, asked, tmp_path):
    settings = ("--set", "digit=8", "--set", "m1=50")
    rest = ("--seconds", "6", "--seed", "3", "--backend", "reference", "--video", "--overwrite")
    assert spikeport("figure", "draw", *settings, *rest, "--out", tmp_path).code == 0
    (request,) = asked
    assert request.settings == ["preset=paper", "digit=8", "m1=50"]
    assert (request.seconds, request.seed, request.backend) == (6.0, 3, "reference")
    assert (request.out, request.overwrite, request.video) == (Path(tmp_path), True, True)


def test_a_figure_leaves_the_folder_of_its_run(spikeport, tmp_path):
    out = tmp_path / "figure"
    options = ("--backend", "analytic", "--seconds", "0.05", "--out", out)
    done = spikeport("figure", "reach", *options)
    assert (done.code, done.err) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == ["figure.png", "probes.nc", "result.json"]


def test_an_unknown_figure_lists_those_there_are(spikeport):
    assert spikeport("figure", "walk") == (
        2,
        "",
        "error: unknown figure 'walk'; there is: draw, reach\n",
    )
