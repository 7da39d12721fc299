"""Nengo's operators, flattened into a tape that computes the same numbers, bit for bit."""

from collections.abc import Callable

import nengo
import nengo.builder
import numpy as np
import pytest
from nengo.builder.neurons import SimNeurons
from nengo.exceptions import SimulationError

from spikeport.backends import tape_kernel as kernel
from spikeport.backends.pooled_signals import PooledSignals
from spikeport.backends.python_steps import product_step
from spikeport.backends.tape import Code, Flattener, Operation, Tape
from spikeport.node_functions import Affine, Held, Skippable

Step = Callable[[], None]


def simulators(network: nengo.Network) -> tuple[nengo.Simulator, nengo.Simulator, Step]:
    """Return Nengo's simulator, one with its signals in a pool, and the step of the latter."""
    model = nengo.builder.Model()
    model.build(network)
    theirs, ours = (nengo.Simulator(None, model=model, progress_bar=False) for _ in range(2))
    return theirs, ours, Flattener(ours, PooledSignals(ours.model), {}).step()


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


def test_every_signal_equals_nengos_bit_for_bit() -> None:
    theirs, ours, step = simulators(chain())
    with theirs, ours:
        for _ in range(100):
            theirs.step()
            step()
            for signal, array in theirs.signals.items():
                if signal is not theirs.model.step:  # the tape has a count of its own
                    np.testing.assert_array_equal(ours.signals[signal], array, err_msg=str(signal))
        (spikes,) = (op.output for op in ours._step_order if type(op) is SimNeurons)
        assert ours.signals[spikes].any()


class EveryFifth(Skippable):
    """A plant with steps of 5 ms, which returns its count of steps and its last command."""

    def __init__(self) -> None:
        self.step, self.called, self.value = 0, 0, np.zeros(2)

    def __call__(self, _t: float, values: np.ndarray) -> np.ndarray:
        self.called += 1
        self.step += 1
        if self.step % 5 == 0:
            self.value = np.array([self.step, values[0]])
        return self.value

    def skip(self) -> int:
        skipped = 4 - self.step % 5
        self.step += skipped
        return skipped


def test_functions_that_may_be_skipped_are_not_called_and_have_nengos_values() -> None:
    plant, by_nengo = EveryFifth(), EveryFifth()
    with nengo.Network(seed=2) as network:
        source = nengo.Node(lambda t: [np.sin(300 * t)], label="source")
        node = nengo.Node(plant, size_in=1, size_out=2, label="plant")
        held = nengo.Node(Held(np.square), size_in=2, size_out=2, label="held")
        product = nengo.Node(size_in=3, label="product")
        closed = nengo.Node(Affine(-1.0, 1.0), size_in=3, label="affine")
        nengo.Connection(source, node, synapse=None)
        nengo.Connection(node, held, synapse=None)
        nengo.Connection(held, product, synapse=None, transform=[[1, 2], [0.1, 0.3], [-1, 0.7]])
        nengo.Connection(product, closed, synapse=None)
    _, ours, step = simulators(network)
    plant.step = plant.called = 0  # Nengo called the plant when its node was made
    with ours:
        for n in range(1, 23):
            node_value = by_nengo(0.0, np.array([np.sin(300 * n * 0.001)]))
            step()
            squared = node_value**2
            weighed = np.dot(np.array([[1, 2], [0.1, 0.3], [-1, 0.7]]), squared)
            for value, name in ((node_value, node), (squared, held), (1 - weighed, closed)):
                found = ours.signals[ours.model.sig[name]["out"]]
                np.testing.assert_array_equal(found, value, err_msg=str(name))
    assert plant.called == 1 + 22 // 5


@pytest.mark.parametrize("changed", [0.0, np.nan])
def test_a_product_is_computed_again_only_if_a_bit_of_its_vector_changes(changed: float) -> None:
    matrix, memory = np.array([[1.0, 2.0]]), np.array([-0.0, 1.0, 0.0])
    tape = Tape(memory)
    products: list[int] = []

    def make(kept: np.ndarray) -> Step:
        add = product_step(matrix, memory[:2], memory[2:], kept[3:])
        return lambda: (products.append(1), add())[1]

    tape.add(Operation(Code(kernel.PRODUCT, 1, 2, 1, 0, 1, state=2), table=np.zeros(4), stop=make))
    run = tape.finish()
    for _ in range(3):
        run()
    assert (memory[2], len(products)) == (6.0, 1)
    memory[0] = changed
    for _ in range(3):
        run()
    assert len(products) == 2


def test_an_affine_value_that_is_not_finite_is_refused_in_nengos_words() -> None:
    with nengo.Network(seed=2) as network:
        node = nengo.Node(Affine(-10.0, 0.5), size_in=1, label="gates")
        nengo.Connection(nengo.Node([1e308]), node, synapse=None)
    theirs, ours, step = simulators(network)
    with theirs, ours:
        with pytest.raises(SimulationError) as expected:
            theirs.step()
        with pytest.raises(SimulationError) as raised:
            step()
    assert str(raised.value) == str(expected.value)
    assert raised.value.__notes__ == ["in <Node 'gates'>"]


def test_the_tape_stops_only_for_user_functions_and_a_few_operators() -> None:
    theirs, ours, _ = simulators(chain())
    with theirs, ours:
        flattener = Flattener(ours, PooledSignals(ours.model), {})
        found = [flattener._compile(op) for op in ours._step_order]
    kinds = [None if one is None else one.code.what for one in found]
    assert kinds.count(kernel.CALL) == 1  # the user's function
    assert kinds.count(None) <= 2 < len(kinds) // 4  # the gains of a part
