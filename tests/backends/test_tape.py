"""Nengo's operators, flattened: what runs as one, and the same numbers, bit for bit."""

from collections.abc import Callable

import nengo
import nengo.builder
import numpy as np
from nengo.builder.neurons import SimNeurons

from spikeport.backends.tape import Flattener, PooledSignals

Functions = list[Callable[[], None]]


def simulators(network: nengo.Network) -> tuple[nengo.Simulator, nengo.Simulator, Functions]:
    """Nengo's simulator, one of the same signals in a pool, and the functions of its step."""
    model = nengo.builder.Model()
    model.build(network)
    theirs, ours = (nengo.Simulator(None, model=model, progress_bar=False) for _ in range(2))
    functions = Flattener(ours, PooledSignals(ours.model), {}).functions()
    return theirs, ours, functions


def chain() -> nengo.Network:
    with nengo.Network(seed=2) as network:
        source = nengo.Node(lambda t: [np.sin(30 * t), 0.3], label="source")
        through = nengo.Node(size_in=2, label="through")
        relu = nengo.Ensemble(8, 2, neuron_type=nengo.SpikingRectifiedLinear(), label="relu")
        end = nengo.Node(size_in=3, label="end")
        nengo.Connection(source, through, synapse=0.005, label="into")
        nengo.Connection(nengo.Node([0.1, 0.2]), through, synapse=None, label="beside")
        nengo.Connection(through, relu.neurons[:2], synapse=None, transform=200, label="on")
        nengo.Connection(relu.neurons[:3], end, synapse=0.01, label="out")
    return network


def test_every_signal_is_nengos_bit_for_bit() -> None:
    theirs, ours, functions = simulators(chain())
    with theirs, ours:
        for _ in range(100):
            theirs.step()
            for function in functions:
                function()
            for signal, array in theirs.signals.items():
                np.testing.assert_array_equal(ours.signals[signal], array, err_msg=str(signal))
        (spikes,) = (op.output for op in ours._step_order if type(op) is SimNeurons)
        assert ours.signals[spikes].any()


def test_simple_operators_between_others_run_as_one_function() -> None:
    theirs, ours, functions = simulators(chain())
    with theirs, ours:
        # not simple: the clock, the user's function, the encoders and the gains of a part
        assert len(functions) <= 4 + 5 < len(ours._step_order)


def test_signals_of_the_pool_lie_in_one_array() -> None:
    theirs, ours, _ = simulators(chain())
    with theirs, ours:
        signals = ours.signals
        array = signals.memory[4:10]
        assert signals.place(array) == (4, 1)
        assert signals.place(array[::2]) == (4, 2)
        assert signals.place(array[::-1]) == (9, -1)
        assert signals.place(array.reshape(2, 3)) == (4, 1)
        assert signals.place(array.reshape(2, 3)[:, :2]) is None
        assert signals.place(np.zeros(3)) is None
        assert signals.place(np.zeros(3, dtype=np.float32)) is None


def test_memory_is_given_out_once() -> None:
    with nengo.Simulator(chain(), progress_bar=False) as simulator:
        signals = PooledSignals(simulator.model, extra=5)
        extra = signals.allocate(5)
        extra[:] = 7
        assert signals.allocate(3).size == 0  # the pool ends there
        others = [array for array in signals.values() if array.dtype == np.float64]
        assert not any(np.may_share_memory(extra, array) for array in others)
