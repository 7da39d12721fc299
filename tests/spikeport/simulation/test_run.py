"""Runs beside float Nengo, and their errors."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from spikeport import Simulator
from spikeport.errors import BackendError, UsageError
from spikeport.simulation.run import Recorded, RunOptions, run


def test_both_runs_are_those_of_a_simulator(ran, network):
    net = network()
    for backend, field in (("native", "values"), ("reference", "values_float")):
        with Simulator(net, backend=backend, seed=0) as sim:
            sim.run_steps(100)
        for probe, one in zip(net.all_probes, ran.recorded.values(), strict=True):
            np.testing.assert_array_equal(getattr(one, field), sim.data[probe])
            np.testing.assert_array_equal(one.times_s, sim.trange(probe.sample_every))
    assert ran.report_json["image_digest"] == ran.report.digest
    assert ran.activity.n_steps == 100


def test_the_error_is_relative_and_filtered(ran):
    errors = {name: one.error() for name, one in ran.recorded.items()}
    assert errors.pop("stimulus") == 0
    assert all(0.001 < error < 1 for error in errors.values())
    times_s = np.arange(1, 101) * 0.001
    ones = np.ones((100, 2))
    assert Recorded(times_s, 1.5 * ones, ones, False).error() == pytest.approx(0.5)
    ripple = np.where(np.arange(100) % 2, 1.5, 0.5)[:, np.newaxis]
    assert Recorded(times_s, ripple, ones[:, :1], False).error() < 0.05


def test_a_delay_is_named_with_the_error_that_is_left():
    times_s = np.arange(1, 501) * 0.001
    exact = np.sin(20 * times_s)[:, np.newaxis]
    late = Recorded(times_s, np.roll(exact, 12, axis=0) * (times_s > 0.012)[:, None], exact, False)
    delay_s, error = late.delayed()
    assert delay_s == pytest.approx(0.012)
    assert error < 1e-6 < 0.1 < late.error()
    assert Recorded(times_s, exact, exact, False).delayed() is None


def test_an_error_that_is_not_known_is_none(ran):
    one = ran.recorded["stimulus"]
    assert replace(one, values_float=None).error() is None
    assert replace(one, values_float=0 * one.values).error() is None
    assert Recorded(one.times_s[:1], one.values[:1], one.values[:1], False).error() is None


def test_a_run_without_a_chip_has_no_report_and_nothing_beside(network):
    done = run(network(), RunOptions(steps=5, backend="reference"))
    assert (done.report, done.report_json) == (None, None)
    assert {one.values_float is None for one in done.recorded.values()} == {True}
    alone = run(network(), RunOptions(steps=5, backend="nengo_loihi", beside_float=False))
    assert alone.backend == "nengo-loihi"
    assert {one.error() for one in alone.recorded.values()} == {None}


def test_a_step_that_raises_is_named(network):
    net = network(lambda t: 1 / (t < 0.0035))
    with pytest.raises(BackendError) as caught:
        run(net, RunOptions(steps=10))
    assert str(caught.value) == (
        "simulating on native: step 4: the network raised ZeroDivisionError: division by zero"
    )
    with pytest.raises(UsageError, match=r"^unknown backend 'chip'"):
        run(network(), RunOptions(steps=1, backend="chip"))


class Counter:
    """A callable with a state."""

    def __init__(self, lock=None):
        self.calls, self.lock = 0, lock

    def __call__(self, t):
        self.calls += t > 0  # Nengo calls it at its construction, too
        return self.calls / 100


@pytest.mark.parametrize("lock", [None, threading.Lock()], ids=["copied", "cannot be copied"])
def test_float_nengo_runs_a_copy_where_there_can_be_one(network, lock):
    counter = Counter(lock)
    one = run(network(counter), RunOptions(steps=20)).recorded["stimulus"]
    assert one.values[-1] - one.values[0] == pytest.approx(0.19)
    assert np.array_equal(one.values, one.values_float) == (lock is None)
    assert counter.calls == (20 if lock is None else 40) + round(100 * one.values[0, 0]) - 1


def test_progress_names_compile_and_both_runs(network):
    reported = []
    run(network(), RunOptions(steps=60), lambda what, share: reported.append((what, share)))
    assert reported[0] == ("compiling: checking rules", 0.0)
    assert reported[-4:] == [
        ("simulating on native", 0.0),
        ("simulating on native", 50 / 60),
        ("simulating in float Nengo", 0.0),
        ("simulating in float Nengo", 50 / 60),
    ]
