"""Experiments by name."""

import pytest

from spikeport.errors import MissingExtraError, UsageError
from spikeport.experiments import registry


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
