"""Options of all experiments, and an experiment by its parts."""

import dataclasses

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.options import Experiment, Options


class Trial:
    """Stand-in for a trial."""

    name = "stroll"


@dataclasses.dataclass(frozen=True)
class Settings:
    """Stand-in for settings."""

    steps: int = 3


EXPERIMENT = Experiment(Trial, Settings, ("native",), 10.0, 1.0, pipeline="compact")


def test_an_experiment_has_the_name_of_its_trial():
    assert EXPERIMENT.name == "stroll"


def test_passes_are_those_asked_for_or_the_experiments_own():
    assert EXPERIMENT.passes(None) == "compact"
    assert EXPERIMENT.passes("") == ""
    assert EXPERIMENT.passes("pack") == "pack"


def test_a_backend_that_it_does_not_run_on_is_refused():
    EXPERIMENT.check_backend("native")
    with pytest.raises(UsageError, match="unknown backend of stroll 'board'; choose from: native"):
        EXPERIMENT.check_backend("board")


def test_settings_are_made_of_texts():
    assert EXPERIMENT.parse_settings(["steps=5"]) == {"steps": 5}
    with pytest.raises(UsageError, match="--vary n: expected KEY=VALUE"):
        EXPERIMENT.parse_settings(["n"], option="--vary")
    with pytest.raises(UsageError, match="unknown key of experiment 'stroll' 'n'"):
        EXPERIMENT.parse_settings(["n=1"])


def test_neurons_depend_on_chip_and_passes_and_not_on_the_backend_that_runs_them():
    native, emulator = (Options(1.0, backend=name) for name in ("native", "nengo-loihi"))
    assert native.substrate == emulator.substrate == {"chip": "loihi", "passes": "by default"}
    assert Options(1.0, pipeline="compact").substrate["passes"] == "compact"
    assert Options(1.0, chip="loihi2").substrate["chip"] == "loihi2"


def test_float_neurons_are_on_no_chip():
    float_nengo = Options(1.0, backend="reference", pipeline="compact")
    assert float_nengo.substrate == {"chip": "none", "passes": "none"}


def test_progress_is_no_part_of_what_options_are():
    assert Options(1.0, progress=print) == Options(1.0)
