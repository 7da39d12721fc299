"""Compiles in several threads: they take turns at changing state that all threads share."""

import os
import signal
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import nengo
import nengo_loihi.block
import nengo_loihi.builder.discretize
import numpy as np
import pytest

from spikeport.compile.ground.notices import collected_warnings
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.pipeline import compile_network

N_NETWORKS = 12


def network(seed):
    with nengo.Network(seed=seed) as net:
        source = nengo.Node(np.sin)
        a, b = nengo.Ensemble(20 + seed, 1), nengo.Ensemble(30, 2)
        nengo.Connection(source, a)
        nengo.Connection(a, b, function=lambda x: [x, -x])
        nengo.Probe(b)
    return net


def shared():
    """Return the state that a compile changes, and restores."""
    block, discretize = nengo_loihi.block, nengo_loihi.builder.discretize
    patched = (block.np, block.Synapse.max_abs_weight, discretize.discretize_compartment)
    return (*patched, warnings.showwarning, list(warnings.filters))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_compiles_in_threads_give_the_images_of_sequential_ones_and_leave_nothing_patched():
    def digest(seed):
        return compile_network(network(seed)).image.digest

    before = shared()
    alone = [digest(seed) for seed in range(N_NETWORKS)]
    with ThreadPoolExecutor(4) as pool:
        together = pool.map(digest, range(N_NETWORKS))
        assert list(together) == alone
    assert shared() == before


@pytest.mark.parametrize("section", [numpy1_semantics, collected_warnings])
def test_a_section_that_changes_shared_state_waits_for_its_turn(section):
    started, entered, before = threading.Event(), threading.Event(), shared()

    def enter():
        started.set()
        with section():
            entered.set()

    other = threading.Thread(target=enter)
    with section():
        other.start()
        assert started.wait(20)
        assert not entered.wait(0.1)
    assert entered.wait(20)
    other.join()
    assert shared() == before


@pytest.mark.filterwarnings("ignore")
def test_a_fork_waits_for_the_compile_of_another_thread():
    entered, leave, before = threading.Event(), threading.Event(), shared()

    def enter():
        with numpy1_semantics():
            entered.set()
            leave.wait(20)

    other = threading.Thread(target=enter)
    other.start()
    assert entered.wait(20)
    threading.Timer(0.1, leave.set).start()
    if (child := os.fork()) == 0:
        signal.alarm(20)  # ends a child that waits for ever
        with numpy1_semantics():
            pass
        os._exit(0 if shared()[:3] == before[:3] else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    other.join()
