"""Interrupts of long runs: the data until then, and simulators that go on or refuse to."""

import os
import signal
from itertools import pairwise

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.errors import BackendError

LAST_STEP = 38


def interrupted_network(interrupts: int = 1) -> tuple[nengo.Network, list[nengo.Probe]]:
    """Return a network that sends itself SIGINT within a step, as Ctrl-C does, and its probes."""

    def source(t: float) -> float:
        if round(t / 0.001) == LAST_STEP:
            for _ in range(interrupts):
                os.kill(os.getpid(), signal.SIGINT)
        return np.sin(20 * t)

    with nengo.Network(seed=0) as network:
        node = nengo.Node(source)
        ensemble = nengo.Ensemble(20, 1)
        host = nengo.Node(lambda _t, x: x, size_in=1)
        nengo.Connection(node, ensemble)
        nengo.Connection(ensemble, host)
        probes = [nengo.Probe(obj) for obj in (node, ensemble, ensemble.neurons, host)]
    return network, probes


pytestmark = pytest.mark.usefixtures("interruptible")
backends = pytest.mark.parametrize("backend", ["native", "nengo-loihi", "reference"])


@backends
def test_data_up_to_the_interrupt_is_readable(backend: str) -> None:
    network, probes = interrupted_network()
    with spikeport.Simulator(network, backend=backend) as sim:
        with pytest.raises(KeyboardInterrupt):
            sim.run_steps(100)
        assert sim.n_steps == LAST_STEP
        assert [len(sim.data[probe]) for probe in probes] == [LAST_STEP] * len(probes)
        assert len(sim.trange()) == LAST_STEP
        assert sim.activity.n_steps == LAST_STEP
    assert all(len(sim.data[probe]) == LAST_STEP for probe in probes)  # also after it is closed
    assert all(np.any(a != b) for a, b in pairwise(sim.data[probes[0]]))


@backends
def test_a_run_goes_on_after_an_interrupt_as_if_there_had_been_none(backend: str) -> None:
    network, probes = interrupted_network()
    with spikeport.Simulator(network, backend=backend) as sim:
        with pytest.raises(KeyboardInterrupt):
            sim.run_steps(100)
        sim.run_steps(100 - LAST_STEP)
    quiet, quiet_probes = interrupted_network(interrupts=0)
    with spikeport.Simulator(quiet, backend=backend) as whole:
        whole.run_steps(100)
    for probe, other in zip(probes, quiet_probes, strict=True):
        np.testing.assert_array_equal(sim.data[probe], whole.data[other])


def test_the_handler_of_sigint_is_restored_after_a_run() -> None:
    network, _ = interrupted_network()
    with spikeport.Simulator(network) as sim, pytest.raises(KeyboardInterrupt):
        sim.run_steps(100)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_interrupt_breaks_the_step_off_and_the_simulator_refuses_to_go_on() -> None:
    network, probes = interrupted_network(interrupts=2)
    with spikeport.Simulator(network) as sim:
        with pytest.raises(KeyboardInterrupt):
            sim.run_steps(100)
        for advance in (sim.step, lambda: sim.run_steps(2)):
            with pytest.raises(BackendError) as caught:
                advance()
            assert str(caught.value) == (
                "step 38 was broken off, or another thread is in it, so that host and chip are not "
                "at the same step; reset() the simulator, or keep to one thread"
            )
        sim.reset()
        sim.run_steps(LAST_STEP - 1)
        assert [len(sim.data[probe]) for probe in probes] == [LAST_STEP - 1] * len(probes)


def test_a_users_own_handler_of_sigint_stays_in_place() -> None:
    caught: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _frame: caught.append(number))
    network, _ = interrupted_network()
    with spikeport.Simulator(network) as sim:
        sim.run_steps(100)
    assert caught == [signal.SIGINT]
