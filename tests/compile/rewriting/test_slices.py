"""Connections to or from slices, rewritten as connections of whole objects."""

from collections.abc import Callable
from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.reference import Reference
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.pipeline import compile_network
from spikeport.compile.rewriting.slices import whole_targets
from tests.helpers.small_networks import DT_S, rewrite_of

PARTS = [0, -1, slice(1, 3), slice(None, None, -2), [2, 0], slice(0, 3), np.array([0, 1, 2])]
SOURCES = ["node", "function", "decoded", "neurons"]


def network(source: str, part: Any, neurons: bool = False) -> nengo.Network:
    """Return a node, an ensemble that follows it, and a connection from either to a part of b."""
    size = np.arange(3)[[part] if isinstance(part, int) else part].size
    with nengo.Network(seed=4) as net:
        u = nengo.Node(lambda t: np.sin(20 * t + np.arange(size)), label="u")
        a = nengo.Ensemble(30, size, label="a")
        b = nengo.Ensemble(3 if neurons else 40, 3, label="b", radius=1.5)
        nengo.Connection(u, a)
        target = (b.neurons if neurons else b)[part]
        if source == "neurons":
            nengo.Connection(a.neurons[:size], target, transform=1e-3)
        elif source == "decoded":
            nengo.Connection(a, target, function=lambda x: x + 0.2, synapse=0.01)
        else:
            nengo.Connection(u, target, function=np.square if source == "function" else None)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    return net


def rewritten(net: nengo.Network) -> Rewrite:
    return whole_targets(rewrite_of(net), DT_S)


def assert_same_in_float(net: nengo.Network, n_steps: int = 60) -> None:
    """Assert that float Nengo computes the same before and after the rewrite, to rounding."""
    after = Reference(rewritten(net), DT_S, seed=0)
    with nengo.Simulator(net, progress_bar=False, seed=0) as before:
        for _ in range(n_steps):
            before.step()
            after.step()
        for probe in net.all_probes:
            np.testing.assert_allclose(after.data(probe), before.data[probe], atol=1e-9)
            assert np.any(before.data[probe])


@pytest.mark.parametrize("part", PARTS, ids=str)
@pytest.mark.parametrize("source", SOURCES)
def test_connections_to_parts_compute_the_same_in_float(source: str, part: Any) -> None:
    net = network(source, part)
    assert_same_in_float(net)
    after = rewritten(net)
    assert [c.post_slice for c in after.network.all_connections] == [slice(None)] * 2
    compile_network(net)


@pytest.mark.parametrize("part", PARTS[:4], ids=str)
@pytest.mark.parametrize("source", SOURCES)
def test_connections_to_parts_of_neurons_compute_the_same_in_float(source: str, part: Any) -> None:
    net = network(source, part, neurons=True)
    assert_same_in_float(net)
    compile_network(net)


def test_an_entry_that_occurs_twice_receives_the_sum() -> None:
    with nengo.Network(seed=4) as net:
        u, b = nengo.Node([0.3, 0.4]), nengo.Ensemble(40, 3)
        nengo.Connection(u, b[[1, 1]])
        nengo.Probe(b, synapse=0.01)
    (whole,) = rewritten(net).network.connections
    np.testing.assert_array_equal(whole.transform.sample(), [[0, 0], [1, 1], [0, 0]])
    assert_same_in_float(net)


def test_weights_of_an_ensemble_on_the_host_may_end_in_a_part() -> None:
    with nengo.Network(seed=4) as net:
        spikeport.add_params(net)
        host, b = nengo.Ensemble(20, 1), nengo.Ensemble(40, 3)
        net.config[host].on_chip = False
        solver = nengo.solvers.LstsqL2(weights=True)
        nengo.Connection(host, b[1], solver=solver, synapse=0.02)
        nengo.Probe(b, synapse=0.01)
    assert_same_in_float(net)
    compile_network(net)


FROM = ["node", "function", "passthrough", "decoded", "squares", "decoders", "neurons"]


def slice_twice(source: str) -> nengo.Network:
    """Return a connection from a source, whose slice reads an entry twice, to a part of b."""
    with nengo.Network(seed=4) as net:
        spikeport.add_params(net)
        u = nengo.Node(lambda t: [np.sin(20 * t), 0.3, 0.5], label="u")
        a, b = nengo.Ensemble(30, 3, label="a"), nengo.Ensemble(40, 3, label="b")
        nengo.Connection(u, a)
        host, through = nengo.Ensemble(9, 1, label="host"), nengo.Node(size_in=3)
        net.config[host].on_chip = False
        nengo.Connection(u[0], host)
        nengo.Connection(u, through)
        start, options = {
            "node": (u, {}),
            "function": (u, {"function": lambda x: x[[1, 0]] ** 2}),
            "passthrough": (through, {}),
            "decoded": (a, {}),
            "squares": (a, {"function": lambda x: x[[1, 0]] ** 2}),
            "decoders": (a, {"solver": nengo.solvers.NoSolver(1e-3 * np.ones((30, 2)))}),
            "neurons": (host.neurons, {"transform": 1e-3}),
        }[source]
        nengo.Connection(start[[2, 2]], b[[0, 1]], **options)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    return net


@pytest.mark.parametrize("source", FROM)
def test_a_slice_may_read_an_entry_twice(source: str) -> None:
    assert_same_in_float(slice_twice(source))
    for pipeline in ("as_written", "compact"):
        compile_network(slice_twice(source), pipeline=pipeline)


def reading_twice(target: str, transform: Any) -> nengo.Network:
    with nengo.Network(seed=4) as net:
        a = nengo.Ensemble(3, 1, gain=np.ones(3), bias=[3.0, 5.0, 9.0])
        b = nengo.Ensemble(3 if target == "neurons" else 40, 3)
        post = b.neurons if target == "neurons" else b[[0, 0, 2]] if target == "part" else b
        nengo.Connection(a.neurons[[1, 1, -3]], post, transform=transform)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    return net


@pytest.mark.parametrize("target", ["neurons", "values", "part"])
@pytest.mark.parametrize("transform", [0.02, [0.02, 0.01, 0.03]])
def test_a_neuron_that_is_read_twice_sends_the_sum(target: str, transform: Any) -> None:
    net = reading_twice(target, transform)
    assert_same_in_float(net)
    (whole,) = rewritten(net).network.connections
    weights = whole.transform.sample()
    dense = weights if isinstance(weights, np.ndarray) else weights.toarray()
    rows = [0, 0, 2] if target == "part" else [0, 1, 2]
    expected = np.zeros((3, 3))
    np.add.at(expected, (rows, [1, 1, 0]), transform)
    np.testing.assert_allclose(dense, expected)


def test_a_sparse_transform_may_read_a_neuron_twice() -> None:
    net = reading_twice("neurons", nengo.Sparse((3, 3), indices=[(0, 0), (2, 1), (2, 2)], init=0.1))
    (whole,) = rewritten(net).network.connections
    expected = [[0, 0.1, 0], [0, 0, 0], [0.1, 0.1, 0]]
    np.testing.assert_allclose(whole.transform.sample().toarray(), expected)


def test_reading_a_neuron_twice_gives_the_image_of_a_sparse_transform() -> None:
    twice = reading_twice("neurons", 0.02)
    with nengo.Network(seed=4) as once:
        a = nengo.Ensemble(3, 1, gain=np.ones(3), bias=[3.0, 5.0, 9.0])
        b = nengo.Ensemble(3, 3)
        weights = nengo.Sparse((3, 3), indices=[(0, 1), (1, 1), (2, 0)], init=0.02)
        nengo.Connection(a.neurons, b.neurons, transform=weights)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    for pipeline in ("as_written", "compact"):
        one, other = (compile_network(net, pipeline=pipeline).image for net in (twice, once))
        assert one.digest == other.digest


def test_random_transforms_are_sampled_as_in_float_nengo() -> None:
    with nengo.Network(seed=4) as net:
        a, b = nengo.Ensemble(20, 2), nengo.Ensemble(30, 3)
        gaussian = nengo.dists.Gaussian(0, 1)
        nengo.Connection(a, b[1:], transform=gaussian)
        nengo.Connection(a.neurons, b.neurons[::2], transform=nengo.Dense((15, 20), gaussian))
        nengo.Probe(b.neurons)
    assert_same_in_float(net)


def sliced() -> nengo.Network:
    with nengo.Network(seed=2) as net:
        u = nengo.Node(lambda t: np.sin(20 * t), label="u")
        a, b = nengo.Ensemble(30, 1, label="a"), nengo.Ensemble(40, 2, label="b")
        nengo.Connection(u, a)
        nengo.Connection(a, b[0], function=np.square, synapse=0.01)
        nengo.Connection(u, b[[1]])
        nengo.Connection(a, b[1], transform=0.5)
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    return net


def with_rows_of_zeros() -> nengo.Network:
    """Return the network of `sliced`, with rows of zeros in place of slices."""
    with nengo.Network(seed=2) as net:
        u = nengo.Node(lambda t: np.sin(20 * t), label="u")
        a, b = nengo.Ensemble(30, 1, label="a"), nengo.Ensemble(40, 2, label="b")
        nengo.Connection(u, a)
        nengo.Connection(a, b, function=np.square, transform=[[1], [0]], synapse=0.01)
        nengo.Connection(u, b, transform=[[0], [1]])
        nengo.Connection(a, b, transform=[[0], [0.5]])
        nengo.Probe(b, synapse=0.01)
        nengo.Probe(b.neurons)
    return net


def test_slices_give_the_image_of_transforms_with_rows_of_zeros() -> None:
    pair = [compile_network(make(), pipeline="").image for make in (sliced, with_rows_of_zeros)]
    assert pair[0].digest == pair[1].digest
    assert pair[0].n_blocks == 5


def test_connections_to_parts_of_neurons_store_no_zeros() -> None:
    with nengo.Network(seed=4) as net:
        a, b = nengo.Ensemble(20, 1), nengo.Ensemble(100, 1)
        nengo.Connection(a.neurons, b.neurons[:5], transform=np.ones((5, 20)) * 1e-3)
    assert len(compile_network(net, pipeline="").image.synapses.weight) == 5 * 20


def test_a_network_without_slices_is_unchanged(chain: Callable[..., nengo.Network]) -> None:
    rewrite = rewrite_of(chain())
    assert whole_targets(rewrite, DT_S) is rewrite


def test_settings_names_and_built_parameters_are_kept() -> None:
    with nengo.Network(seed=4) as net:
        spikeport.add_params(net)
        a, b = nengo.Ensemble(20, 1, label="a"), nengo.Ensemble(30, 2, label="b")
        old = nengo.Connection(a, b[1], transform=0.5)
        net.config[old].decode_path = "onoff"
    after = rewritten(net)
    (whole,) = after.network.connections
    assert after.names[whole] == "a -> b"
    assert after.network.config[whole].decode_path == "onoff"
    assert after.built[old].weights.shape == (1, 20)


def convolution(part: slice) -> nengo.Network:
    with nengo.Network(seed=4) as net:
        a, b = nengo.Ensemble(16, 1, label="a"), nengo.Ensemble(4, 1, label="b")
        for one in (a, b):
            one.gain, one.bias = np.ones(one.n_neurons), np.zeros(one.n_neurons)
        shape = nengo.transforms.ChannelShape((4, 4, 1))
        transform = nengo.Convolution(1, shape, strides=(2, 2), kernel_size=(2, 2))
        nengo.Connection(a.neurons, b.neurons[part], transform=transform)
    return net


def test_a_convolution_reaches_all_neurons_or_is_refused() -> None:
    assert compile_network(convolution(slice(0, 4))).image.n_blocks == 2
    for pipeline in ("as_written", "compact"):
        with pytest.raises(DoesNotFitError, match=r"SP006 slice .* 4 of 4 neurons, limit all"):
            compile_network(convolution(slice(None, None, -1)), pipeline=pipeline)


def test_a_learning_connection_may_end_in_a_part() -> None:
    with nengo.Network(seed=4) as net:
        pre, post = nengo.Ensemble(20, 1, label="pre"), nengo.Ensemble(20, 2, label="post")
        error = nengo.Node(lambda _t, x: x, size_in=1)
        learned = nengo.Connection(pre, post[1], learning_rule_type=nengo.PES())
        nengo.Connection(post[1], error)
        nengo.Connection(error, learned.learning_rule)
        nengo.Connection(nengo.Node(0.5), pre[[0]])
    for pipeline in ("as_written", "compact"):
        assert compile_network(net, pipeline=pipeline).image.learns.sum() == 1


def test_weights_of_zero_into_a_part_are_built() -> None:
    with nengo.Network(seed=0) as net:
        a, b = (nengo.Ensemble(10, 1, label=label) for label in "ab")
        nengo.Connection(a.neurons, b.neurons[:5], transform=np.zeros((5, 10)))
        nengo.Probe(b)
    assert "SP402" in {hint.id for hint in compile_network(net).report.hints}
