"""Experiments by name."""

from pathlib import Path

import pytest

from spikeport import documents
from spikeport.errors import MissingExtraError, UsageError
from spikeport.experiments import registry
from spikeport.experiments.switch.schedule import SHIPPED, load

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", registry.EXPERIMENTS)
def test_an_experiment_has_the_name_it_is_found_by(name):
    assert registry.get(name).name == name


def test_the_error_of_an_unknown_name_lists_the_experiments():
    with pytest.raises(UsageError) as caught:
        registry.get("dance")
    assert str(caught.value) == "unknown experiment 'dance'; choose from: draw, reach, switch, walk"


@pytest.mark.parametrize("name", ["model.py", "model.ipynb", "model.py:make", "package:make"])
def test_the_error_of_a_network_names_the_command_that_runs_it(name):
    with pytest.raises(UsageError) as caught:
        registry.get(name)
    assert str(caught.value) == (
        f"{name}: not an experiment; to run a network, use: spikeport simulate {name}"
    )


def test_the_error_of_an_absent_package_names_the_extra_to_install():
    with pytest.raises(MissingExtraError) as caught:
        registry.imported("a dance", "no_such_package.steps", extra="ballet")
    assert str(caught.value) == (
        "a dance needs the package no_such_package, which is absent; "
        "install it with: pip install 'spikeport[ballet]'"
    )


def test_the_help_names_every_experiment_and_the_page_their_lengths():
    assert "| `EXPERIMENT` | The experiment: draw, reach, switch or walk. |" in documents.commands()
    assert list(registry.EXPERIMENTS) == ["draw", "reach", "switch", "walk"]
    page = " ".join((DOCS / "experiments.md").read_text(encoding="utf-8").split())
    reach, draw, walk = (registry.get(name).seconds for name in ("reach", "draw", "walk"))
    switch = load(SHIPPED["switch"], 60.0).end_s
    assert f"a reach takes {reach:g} s, a drawing {draw:g} s, a walk {walk:g} s, " in page
    assert f"a switch as long as its schedule, {switch:g} s" in page
