"""The options of runs, and the parts of an experiment."""

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


def test_passes_are_the_users_or_else_the_experiments_own():
    assert EXPERIMENT.passes(None) == "compact"
    assert EXPERIMENT.passes("") == ""
    assert EXPERIMENT.passes("pack") == "pack"


def test_a_backend_that_the_experiment_does_not_run_on_is_refused():
    EXPERIMENT.check_backend("native")
    with pytest.raises(UsageError, match="unknown backend of stroll 'board'; choose from: native"):
        EXPERIMENT.check_backend("board")


def test_settings_are_parsed_from_texts():
    assert EXPERIMENT.parse_settings(["steps=5"]) == {"steps": 5}
    with pytest.raises(UsageError, match="--vary n: expected KEY=VALUE"):
        EXPERIMENT.parse_settings(["n"], option="--vary")
    with pytest.raises(UsageError, match="unknown key of experiment 'stroll' 'n'"):
        EXPERIMENT.parse_settings(["n=1"])


def test_substrates_depend_on_chip_and_passes_but_are_equal_on_native_and_nengo_loihi():
    native, emulator = (Options(1.0, backend=name) for name in ("native", "nengo-loihi"))
    assert native.substrate == emulator.substrate == {"chip": "loihi", "passes": "by default"}
    assert Options(1.0, pipeline="compact").substrate["passes"] == "compact"
    assert Options(1.0, chip="loihi2").substrate["chip"] == "loihi2"


def test_float_neurons_have_no_chip_and_no_passes():
    float_nengo = Options(1.0, backend="reference", pipeline="compact")
    assert float_nengo.substrate == {"chip": "none", "passes": "none"}


def test_the_progress_function_does_not_count_when_options_are_compared():
    assert Options(1.0, progress=print) == Options(1.0)


@pytest.mark.parametrize(
    ("backend", "wanted"), [("reference", "reference"), ("replay", "native"), ("board", "native")]
)
def test_calibrations_need_no_link(backend, wanted):
    assert Options(1.0, backend=backend).calibrating_backend == wanted
