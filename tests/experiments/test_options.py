"""Options of all experiments, and an experiment by its parts."""

from spikeport.experiments.options import Experiment, Options


class Trial:
    """Stand-in for a trial."""

    name = "stroll"


EXPERIMENT = Experiment(Trial, dict, ("native",), 10.0, 1.0, pipeline="compact")


def test_an_experiment_has_the_name_of_its_trial():
    assert EXPERIMENT.name == "stroll"


def test_passes_are_those_asked_for_or_the_experiments_own():
    assert EXPERIMENT.passes(None) == "compact"
    assert EXPERIMENT.passes("") == ""
    assert EXPERIMENT.passes("pack") == "pack"


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
