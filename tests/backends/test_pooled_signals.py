"""Signals of a network in one array: where parts of it are, and memory beside them."""

import nengo
import numpy as np

from spikeport.backends.pooled_signals import PooledSignals


def network() -> nengo.Network:
    with nengo.Network(seed=2) as net:
        nengo.Connection(nengo.Node([0.1, 0.2]), nengo.Ensemble(8, 2))
    return net


def test_signals_of_the_pool_lie_in_one_array() -> None:
    with nengo.Simulator(network(), progress_bar=False) as simulator:
        signals = PooledSignals(simulator.model)
        array = signals.memory[4:10]
        assert signals.place(array) == (4, 1)
        assert signals.place(array[::2]) == (4, 2)
        assert signals.place(array[::-1]) == (9, -1)
        assert signals.place(array.reshape(2, 3)) == (4, 1)
        assert signals.place(array.reshape(2, 3)[:, :2]) is None
        assert signals.place(np.zeros(3)) is None
        assert signals.place(np.zeros(3, dtype=np.float32)) is None


def test_memory_of_the_pool_is_allocated_once() -> None:
    with nengo.Simulator(network(), progress_bar=False) as simulator:
        signals = PooledSignals(simulator.model, extra=5)
        extra = signals.allocate(5)
        extra[:] = 7
        assert signals.allocate(3).size == 0  # the pool ends there
        others = [array for array in signals.values() if array.dtype == np.float64]
        assert not any(np.may_share_memory(extra, array) for array in others)
