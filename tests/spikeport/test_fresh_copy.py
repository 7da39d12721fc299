"""Copies of networks, which run as the networks do and change variables of their own."""

import importlib
import inspect
import json
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import nengo
import numpy as np
import pytest

from spikeport.compiled import compiled, make_ready
from spikeport.errors import UsageError
from spikeport.fresh_copy import fresh_copy
from spikeport.node_functions import Skippable
from spikeport.user_code import imported

CALLS = [0]


def counts(_t: float) -> float:
    """Count in a variable of this module."""
    CALLS[0] += 1
    return CALLS[0]


class Counter:
    """An object with a state, which a function calls."""

    def __init__(self) -> None:
        self.calls = 0

    def step(self, _t: float) -> float:
        self.calls += 1
        return self.calls


class Clock:
    """A callable that counts in a variable of its class and in one of this module."""

    calls = 0

    def __call__(self, _t: float) -> float:
        Clock.calls += 1
        CALLS[0] += 1
        return Clock.calls + 1000 * CALLS[0]


def closing_over() -> Callable[[float], float]:
    calls, counter = [0], Counter()

    def function(t: float) -> float:
        calls[0] += 1
        return calls[0] + counter.step(t)

    return function


def network_of(function: Callable[[float], float]) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        nengo.Probe(nengo.Node(function, size_out=1))
    return network


def recorded(network: nengo.Network) -> list[float]:
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run_steps(5)
    return sim.data[network.probes[0]][:, 0].tolist()


@pytest.fixture
def neighbour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return a module that lies beside a script."""
    lines = [
        "calls = 0",
        "def counts(t):",
        "    global calls",
        "    calls += 1",
        "    return calls",
    ]
    (tmp_path / "counting_neighbour.py").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.import_module("counting_neighbour")


@pytest.fixture
def notebook(tmp_path: Path, neighbour: ModuleType) -> ModuleType:
    """Return the module of a notebook, with the code of the script's neighbour in a cell."""
    cell = {"cell_type": "code", "source": inspect.getsource(neighbour)}
    path = tmp_path / "counting_notebook.ipynb"
    path.write_text(json.dumps({"nbformat": 4, "cells": [cell]}))
    return imported(str(path))


@pytest.mark.parametrize("function", [counts, Counter().step, closing_over(), Clock()])
def test_copies_record_the_same_as_the_network_and_share_no_state(
    function: Callable[[float], float],
) -> None:
    begins_anew(function)


@pytest.mark.slow
def test_copies_share_no_state_of_functions_in_a_neighbouring_module(neighbour: ModuleType) -> None:
    begins_anew(neighbour.counts)
    begins_anew(lambda t: neighbour.counts(t))


def test_copies_share_no_state_of_functions_in_a_notebook(notebook: ModuleType) -> None:
    begins_anew(notebook.counts)
    begins_anew(lambda t: notebook.counts(t))


def begins_anew(function: Callable[[float], float]) -> None:
    """Assert that copies made before a run of the network record the same as that run."""
    network = network_of(function)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        copy, other = fresh_copy(network), fresh_copy(network)
    found = recorded(network)
    assert np.ptp(found) > 0
    assert recorded(copy) == recorded(other) == found
    assert recorded(network) != found


def test_functions_of_one_copy_still_share_their_variables() -> None:
    calls = [0]

    def up(_t: float) -> float:
        calls[0] += 1
        return calls[0]

    network = network_of(up)
    with network:
        nengo.Probe(nengo.Node(lambda _t: calls[0], size_out=1))
    copy = fresh_copy(network)
    with nengo.Simulator(copy, progress_bar=False) as sim:
        sim.run_steps(5)
    first, second = (sim.data[probe][-1, 0] for probe in copy.probes)
    assert abs(first - second) <= 1  # depending on the one that is called first
    assert calls == [0]


def test_a_copy_shares_and_calls_code_that_numba_compiled() -> None:
    @compiled
    def double(x: float) -> float:
        return 2 * x

    ready = make_ready(double, 1.0)
    network = network_of(lambda _t: ready(4.0))
    copy = fresh_copy(network)
    ours, theirs = (one.nodes[0].output for one in (network, copy))
    assert theirs is not ours
    assert inspect.getclosurevars(theirs).nonlocals["ready"] is ready
    assert recorded(copy) == [8.0] * 5


def test_a_network_without_functions_is_returned_itself() -> None:
    with nengo.Network() as network:
        nengo.Connection(nengo.Node(nengo.processes.WhiteNoise()), nengo.Ensemble(5, 1))
    assert fresh_copy(network) is network


def test_functions_that_cannot_be_copied_are_shared_with_a_warning() -> None:
    lock, counter = threading.Lock(), Counter()

    def function(t: float) -> float:
        with lock:
            return counter.step(t)

    with pytest.warns(UserWarning, match=r"cannot pickle '_thread.lock' .*; cure: keep a state"):
        copy = fresh_copy(network_of(function))
    recorded(copy)
    assert counter.calls == 5


class Plant(Skippable):
    """A plant that holds what it needs."""

    def __init__(self, needed: object) -> None:
        self.needed = needed

    def __call__(self, _t: float, values: np.ndarray) -> np.ndarray:
        return values

    def skip(self) -> int:
        return 0


def test_a_plant_that_cannot_be_copied_is_refused() -> None:
    """A plant is never shared: a loop refuses its second simulator, at the end of the run."""
    with nengo.Network() as network:
        nengo.Node(Plant(threading.Lock()), size_in=1, size_out=1)
    with pytest.raises(UsageError) as caught:
        fresh_copy(network)
    assert str(caught.value) == (
        "the plant or a port of the network cannot be copied (cannot pickle '_thread.lock' object),"
        " and float Nengo, with which the run is compared, needs a plant of its own; cure: leave "
        "out what cannot be copied, such as a lock, a viewer or an open file, or do not compare: "
        "simulate --no-float, or compile without --loss"
    )
    network.nodes[0].output.needed = None
    assert fresh_copy(network) is not network
