"""Runs beside float Nengo, and their errors."""

import re
import threading

import nengo
import numpy as np
import pytest

import spikeport
from spikeport import Simulator
from spikeport.errors import BackendError, UsageError
from spikeport.simulation.run import SimulationOptions, run


def test_both_runs_equal_those_of_a_simulator(ran, network):
    net = network()
    for backend, field in (("native", "values"), ("reference", "values_float")):
        with Simulator(net, backend=backend, seed=0) as sim:
            sim.run_steps(100)
        for probe, one in zip(net.all_probes, ran.recorded.values(), strict=True):
            np.testing.assert_array_equal(getattr(one, field), sim.data[probe])
            np.testing.assert_array_equal(one.times_s, sim.trange(probe.sample_every))
    assert ran.report_json["image_digest"] == ran.report.digest
    assert ran.activity.n_steps == 100


def test_a_run_without_a_chip_has_no_report_and_no_float_run_beside(network):
    done = run(network(), SimulationOptions(steps=5, backend="reference"))
    assert (done.report, done.report_json) == (None, None)
    assert {one.values_float is None for one in done.recorded.values()} == {True}
    alone = run(network(), SimulationOptions(steps=5, backend="nengo_loihi", beside_float=False))
    assert alone.backend == "nengo-loihi"
    assert {one.error() for one in alone.recorded.values()} == {None}


@pytest.mark.filterwarnings("ignore:no ensemble of the network")
def test_a_network_with_nothing_on_the_chip_is_not_compared_with_itself():
    with nengo.Network(seed=0) as net:
        nengo.Probe(nengo.Node(np.sin), label="sine")
    done = run(net, SimulationOptions(steps=5))
    assert (done.backend, done.report) == ("reference", None)
    assert done.recorded["sine"].values_float is None


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_weights_are_recorded_row_by_row(network):
    net = network()
    with net:
        spikeport.add_params(net)
        ensemble, target = nengo.Ensemble(20, 1), nengo.Node(size_in=2)
        net.config[ensemble].on_chip = False
        learnt = nengo.Connection(
            ensemble, target, function=lambda x: [x, x], learning_rule_type=nengo.PES()
        )
        nengo.Connection(target, learnt.learning_rule)
        nengo.Probe(learnt, "weights", sample_every=0.005, label="weights")
    one = run(net, SimulationOptions(steps=20)).recorded["weights"]
    assert one.values.shape == one.values_float.shape == (4, 40)
    assert one.error() is not None


def test_voltages_in_units_of_the_chip_are_not_compared(network):
    net = network()
    with net:
        (ensemble, *_) = net.all_ensembles
        nengo.Probe(ensemble.neurons, "voltage", label="voltage")
        nengo.Probe(ensemble, label="value")
    recorded = run(net, SimulationOptions(steps=20)).recorded
    assert recorded["voltage"].values_float is None
    assert recorded["value"].values_float is not None


def test_a_step_that_raises_is_named(network):
    net = network(lambda t: 1 / (t < 0.0035))
    with pytest.raises(BackendError) as caught:
        run(net, SimulationOptions(steps=10))
    step, _, place = str(caught.value).partition(" (")
    assert step == (
        "simulating on native: step 4: the network raised ZeroDivisionError: division by zero"
    )
    assert re.fullmatch(r".*test_run\.py, line \d+\)", place)
    with pytest.raises(UsageError, match=r"^unknown backend 'chip'"):
        run(network(), SimulationOptions(steps=1, backend="chip"))


class Failing(nengo.Process):
    def make_step(self, *_arguments):
        raise ZeroDivisionError


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_a_process_that_raises_before_step_1_is_named(network, backend):
    net = network(Failing(default_size_out=1))
    with pytest.raises(BackendError, match=f"^before step 1 on {backend}: the network raised Zero"):
        run(net, SimulationOptions(steps=10, backend=backend))


class Counter:
    """A callable with a state."""

    def __init__(self, lock=None):
        self.calls, self.lock = 0, lock

    def __call__(self, t):
        self.calls += t > 0  # Nengo also calls it when it makes the node
        return self.calls / 100


@pytest.mark.parametrize("lock", [None, threading.Lock()], ids=["copied", "cannot be copied"])
def test_float_nengo_runs_a_copy_of_the_network_if_it_can_be_copied(network, lock):
    counter = Counter(lock)
    one = run(network(counter), SimulationOptions(steps=20)).recorded["stimulus"]
    assert one.values[-1] - one.values[0] == pytest.approx(0.19)
    assert np.array_equal(one.values, one.values_float) == (lock is None)
    assert counter.calls == (20 if lock is None else 40) + round(100 * one.values[0, 0]) - 1


def test_a_run_of_a_network_that_float_nengo_refuses_is_kept_without_a_comparison():
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        nengo.Connection(a, b, transform=nengo.Sparse((1, 1), indices=[(0, 0)]))
        nengo.Probe(b, label="b")
    options = SimulationOptions(steps=5, pipeline="compact")
    with pytest.warns(UserWarning, match="not compared with float Nengo: .*sparse transform"):
        ran = run(network, options)
    assert len(ran.recorded["b"].values) == 5
    assert ran.recorded["b"].values_float is None


def test_progress_names_compile_and_both_runs(network):
    reported = []
    run(network(), SimulationOptions(steps=60), lambda what, share: reported.append((what, share)))
    assert reported[0] == ("compiling: checking rules", 0.0)
    assert reported[-4:] == [
        ("simulating on native", 0.0),
        ("simulating on native", 50 / 60),
        ("simulating in float Nengo", 0.0),
        ("simulating in float Nengo", 50 / 60),
    ]


@pytest.mark.filterwarnings("ignore:no ensemble of the network")
def test_progress_names_the_backend_that_runs():
    with nengo.Network(seed=0) as net:
        nengo.Probe(nengo.Node(np.sin))
    stages = []
    run(net, SimulationOptions(steps=2), lambda what, _share: stages.append(what))
    assert "simulating on reference" in stages
    assert "simulating on native" not in stages
