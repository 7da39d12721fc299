"""Cures of networks that nengo-loihi refuses, each carried out as the message names it."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import nengo
import numpy as np
import pytest
from nengo.dists import Choice

from spikeport.compile.check.cures import ANY, CURES, cure_of
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.pipeline import compile_network
from tests.helpers.cured import network_of, on_host

EVEN = {"gain": Choice([1.0]), "bias": Choice([0.0])}
PLANE = nengo.Convolution(1, (4, 4, 1), kernel_size=(3, 3))
LINE = nengo.Convolution(1, (16, 1), kernel_size=(3,), strides=(1,))
FLAT_LINE = nengo.Convolution(1, (16, 1, 1), kernel_size=(3, 1))
SPARSE = nengo.Sparse((2, 2), indices=[[0, 0], [1, 1]], init=[1.0, 2.0])
ZEROS = nengo.Sparse((10, 10), indices=[[0, 0]], init=[0.0])
DENSE = SPARSE.sample(np.random.RandomState(0)).toarray()
RELAY = partial(nengo.Node, lambda t, x: x)


class Case(NamedTuple):
    """A network that is refused, the words of its refusal in `CURES`, and the cured network."""

    words: str
    refused: Callable[[], object]
    cured: Callable[[], object]


def learned(from_neurons: bool = False, synapse: nengo.synapses.Synapse | float = 0.005) -> None:
    a, target = nengo.Ensemble(10, 1), nengo.Node(size_in=1)
    rule = nengo.PES(pre_synapse=synapse)
    pre, transform = (a.neurons, np.ones((1, 10))) if from_neurons else (a, 1.0)
    connection = nengo.Connection(pre, target, transform=transform, learning_rule_type=rule)
    nengo.Connection(target, connection.learning_rule)


def ends_of_learning(on_chip: str) -> None:
    """Add a connection that learns into an ensemble, from the error of another."""
    pre, target, error = (nengo.Ensemble(10, 1) for _ in range(3))
    connection = nengo.Connection(pre, target, learning_rule_type=nengo.PES())
    nengo.Connection(error, connection.learning_rule)
    config = nengo.Network.context[0].config
    if on_chip:
        config[{"target": target, "error": error}[on_chip]].on_chip = True


def convolved_from_node(relay: bool) -> None:
    target = nengo.Ensemble(PLANE.output_shape.size, 1, **(EVEN if relay else {}))
    source = nengo.Node(np.ones(16))
    if not relay:
        nengo.Connection(source, target.neurons, transform=PLANE)
        return
    between = nengo.Ensemble(16, 1)
    on_host(between)
    nengo.Connection(source, between.neurons)
    nengo.Connection(between.neurons, target.neurons, transform=PLANE)


def convolved_on_host(relay: bool) -> None:
    source, target = nengo.Ensemble(16, 1), RELAY(size_in=PLANE.output_shape.size)
    between = RELAY(size_in=16) if relay else source.neurons
    if relay:
        nengo.Connection(source.neurons, between, synapse=None)
    nengo.Connection(between, target, transform=PLANE)


def convolved(transform: nengo.Convolution = PLANE, **target: object) -> None:
    a, b = nengo.Ensemble(16, 1), nengo.Ensemble(transform.output_shape.size, 1, **target)
    nengo.Connection(a.neurons, b.neurons, transform=transform)


def grouped(groups: int) -> None:
    """Connect by a convolution of two groups, or of one whose kernel has zeros between them."""
    kernel = np.full((3, 3, 2 // groups, 2), 0.01)
    if groups == 1:
        kernel *= np.eye(2)
    plane = nengo.Convolution(2, (4, 4, 2), kernel_size=(3, 3), groups=groups, init=kernel)
    pre, post = nengo.Ensemble(32, 1), nengo.Ensemble(plane.output_shape.size, 1, **EVEN)
    nengo.Connection(pre.neurons, post.neurons, transform=plane)


def into_chip(transform: object) -> None:
    nengo.Connection(nengo.Node([1, 1]), nengo.Ensemble(10, 2), transform=transform)


def on_chip(transform: object) -> None:
    nengo.Connection(nengo.Ensemble(10, 2), nengo.Ensemble(10, 2), transform=transform)


def read_out(intercept: float) -> None:
    points = {"eval_points": [[0.0], [0.1]], "intercepts": Choice([intercept])}
    nengo.Connection(nengo.Ensemble(10, 1, **points), RELAY(size_in=1))


def loop(synapse_s: float = 0.005, **ensemble: object) -> None:
    a = nengo.Ensemble(20, 1, **ensemble)
    nengo.Connection(a, a, synapse=synapse_s)


def biased(bias: float) -> None:
    a = nengo.Ensemble(2, 1, gain=np.ones(2), bias=np.full(2, bias))
    nengo.Connection(a.neurons, a.neurons, transform=1e-6)


def driven(gain: float) -> None:
    a = nengo.Ensemble(4, 1, gain=[gain, 1, 1, 1], bias=[0, 1, 1, gain])
    nengo.Connection(nengo.Node(0.5), a)


def wired(transform: float | nengo.Sparse) -> None:
    a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    nengo.Connection(a.neurons, b.neurons, transform=transform)


def non_compositional(**transform: float) -> None:
    a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    nengo.Connection(a, b, solver=nengo.solvers.Nnls(weights=True), **transform)


def value_twice(output: Callable[[float, np.ndarray], np.ndarray] | None) -> None:
    a, node = nengo.Ensemble(10, 1), nengo.Node(output, size_in=2)
    nengo.Connection(a[[0, 0]], node, function=lambda x: x)
    nengo.Connection(node, nengo.Ensemble(10, 2))


def through_node(function: Callable[..., object] | None) -> None:
    a, node = nengo.Ensemble(10, 1), nengo.Node(function, size_in=1)
    nengo.Connection(a, node, transform=Choice([[1.0]]))
    nengo.Connection(node, nengo.Ensemble(10, 1))


def sparse_behind_node(transform: object) -> None:
    a, node = nengo.Ensemble(10, 2), nengo.Node(size_in=2)
    nengo.Connection(a, node)
    nengo.Connection(node, nengo.Ensemble(10, 2), transform=transform)


def full_weights(solver: bool) -> None:
    a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    options = {"solver": nengo.solvers.LstsqL2(weights=True)} if solver else {}
    nengo.Connection(a, b.neurons, transform=np.ones((10, 1)), **options)


def filtered_twice(function: Callable[..., object] | None) -> None:
    a, node = nengo.Ensemble(10, 1), nengo.Node(function, size_in=1)
    nengo.Connection(a, node, synapse=nengo.Alpha(0.01))
    nengo.Connection(node, nengo.Ensemble(10, 1), synapse=0.01)


def filtered_before_node(synapse: nengo.synapses.Synapse) -> None:
    a, node = nengo.Ensemble(10, 1), nengo.Node(size_in=1)
    nengo.Connection(a, node, synapse=synapse)
    nengo.Connection(node, nengo.Ensemble(10, 1), synapse=None)


def probed_from_host(end: bool) -> None:
    a = nengo.Ensemble(10, 1)
    connection = nengo.Connection(nengo.Node(0.5), a)
    nengo.Probe(a if end else connection)


def regular(outside: float, inside: float) -> None:
    kind = nengo.RegularSpiking(nengo.LIFRate(amplitude=inside), amplitude=outside)
    nengo.Ensemble(10, 1, neuron_type=kind)


CASES = [
    Case("cannot convert float infinity", partial(wired, ZEROS), partial(nengo.Ensemble, 10, 1)),
    Case("Learning rule presynaptic object must be", partial(learned, from_neurons=True), learned),
    Case("Loihi only supports `Lowpass`", partial(learned, synapse=nengo.Alpha(0.01)), learned),
    Case(
        "Cannot handle non-Lowpass",
        partial(filtered_before_node, nengo.Alpha(0.01)),
        partial(filtered_before_node, nengo.Lowpass(0.02)),
    ),
    Case("tracing_mag", partial(learned, synapse=0), partial(learned, synapse=0.001)),
    Case(
        "of learned connection", partial(ends_of_learning, "target"), partial(ends_of_learning, "")
    ),
    Case("of error connection", partial(ends_of_learning, "error"), partial(ends_of_learning, "")),
    Case(
        "Conv2D transforms not supported",
        partial(convolved_from_node, relay=False),
        partial(convolved_from_node, relay=True),
    ),
    Case("'Sparse' transforms", partial(into_chip, SPARSE), partial(into_chip, DENSE)),
    Case("Applying a sparse transform", partial(on_chip, SPARSE), partial(on_chip, DENSE)),
    Case(
        "'Convolution' transforms on chip to host",
        partial(convolved_on_host, relay=False),
        partial(convolved_on_host, relay=True),
    ),
    Case("must have the same gain", convolved, partial(convolved, **EVEN)),
    Case(
        "nengo-loihi only supports 2D",
        partial(convolved, LINE, **EVEN),
        partial(convolved, FLAT_LINE, **EVEN),
    ),
    Case("kernel_cols", partial(grouped, 2), partial(grouped, 1)),
    Case("Non-compositional", non_compositional, partial(non_compositional, transform=1.0)),
    Case("'activities' matrix is all zero", partial(read_out, 0.99), partial(read_out, -0.5)),
    Case("is not probeable", partial(probed_from_host, False), partial(probed_from_host, True)),
    Case(
        "negative or non-finite gain",
        partial(loop, max_rates=Choice([1.0])),
        partial(loop, max_rates=Choice([100.0])),
    ),
    Case(
        "Max rates must be below",
        partial(loop, neuron_type=nengo.LIF(tau_ref=0.0135)),
        partial(loop, neuron_type=nengo.LIF(tau_ref=0.001)),
    ),
    Case(
        "NaNs detected in",
        partial(loop, encoders=np.zeros((20, 1))),
        partial(loop, encoders=np.ones((20, 1))),
    ),
    Case("Amplitude is not supported", partial(regular, 1, 0.5), partial(regular, 0.5, 1)),
    Case("Current (U) scaling", partial(loop, synapse_s=8.3), partial(loop, synapse_s=8.1)),
    Case(
        "Voltage (V) scaling",
        partial(loop, neuron_type=nengo.LIF(tau_rc=8.3)),
        partial(loop, neuron_type=nengo.LIF(tau_rc=8.1)),
    ),
    Case("Could not find", partial(biased, 1e9), partial(biased, 1.0)),
    Case("vth_to_manexp", partial(driven, 1e6), partial(driven, 1.0)),
    Case(
        "Mergeable transforms must be specified",
        partial(through_node, None),
        partial(through_node, lambda t, x: x),
    ),
    Case(
        "Mergeable transforms must be Dense",
        partial(sparse_behind_node, SPARSE),
        partial(sparse_behind_node, DENSE),
    ),
    Case(
        "assert isinstance(conn.post_obj",
        partial(full_weights, solver=True),
        partial(full_weights, solver=False),
    ),
    Case(
        "cannot merge the filters",
        partial(filtered_twice, None),
        partial(filtered_twice, lambda t, x: x),
    ),
    Case(
        "object selection has repeated",
        partial(value_twice, None),
        partial(value_twice, lambda t, x: x),
    ),
]
NENGOS = ("negative", "Max rates", "NaNs", "Non-compositional", "Applying a")
OF_NENGO = [words for words in CURES if words.startswith(NENGOS)]
"""Refusals that are the same on the host."""


def test_every_cure_has_a_case() -> None:
    for words in CURES:
        assert len([case for case in CASES if words.startswith(case.words)]) == 1, words
    assert len(CASES) == len(CURES)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.words[:30])
def test_a_refusal_names_its_cure_and_the_cured_network_compiles(case: Case) -> None:
    with pytest.raises(RefusedError) as raised:
        compile_network(network_of(case.refused), pipeline="")
    words = next(words for words in CURES if words.startswith(case.words))
    assert f"; cure: {CURES[words]}" in str(raised.value)
    assert ("keep its ensembles on the host" in str(raised.value)) == (words not in OF_NENGO)
    compile_network(network_of(case.cured), pipeline="")


def test_the_cure_of_a_convolved_node_includes_the_cure_of_the_next_refusal() -> None:
    assert CURES["Conv2D transforms not supported for off-chip"].endswith(
        CURES["must have the same gain"]
    )


def test_no_pre_synapse_and_one_of_no_steps_get_the_same_cure() -> None:
    for synapse in (None, nengo.Lowpass(0), 0.0004):
        with pytest.raises(RefusedError, match="with a tau of one time step or more"):
            compile_network(network_of(partial(learned, synapse=synapse)))
    compile_network(network_of(partial(learned, synapse=0.0004)), dt=0.0004)


def test_weights_between_neurons_that_are_too_large_can_be_scaled_down() -> None:
    with pytest.raises(RefusedError, match="the transform of a connection between neurons"):
        compile_network(network_of(partial(wired, -1.0)))
    compile_network(network_of(partial(wired, -0.1)))


def test_an_unknown_refusal_gets_the_general_cure() -> None:
    assert cure_of(ValueError("something else")) == ANY
