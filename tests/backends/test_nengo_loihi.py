"""Every number of every probe against nengo-loihi's, bit for bit."""

from collections.abc import Callable, Iterator
from typing import Any

import nengo
import nengo_loihi
import nengo_loihi.builder.builder
import numpy as np
import pytest
from nengo_loihi.decode_neurons import NoisyDecodeNeurons

import spikeport

STEPS = 300
EVAL_POINTS = np.random.RandomState(3).uniform(-1, 1, (400, 2))


def sine(t: float) -> float:
    return np.sin(20 * t)


def node(size: int, factor: float = 1.0) -> nengo.Node:
    return nengo.Node(lambda _t, x: factor * x, size_in=size)


def feed_forward() -> None:
    u = nengo.Node(sine)
    a, b = nengo.Ensemble(60, 1), nengo.Ensemble(50, 2, radius=1.5)
    nengo.Connection(u, a)
    nengo.Connection(a, b, transform=[[1], [0.5]], synapse=0.02)
    nengo.Probe(b)
    nengo.Probe(a.neurons)


def nothing_on_the_host() -> None:
    a = nengo.Ensemble(40, 1)
    nengo.Connection(a, a, function=lambda x: x + 0.5)
    nengo.Probe(a, synapse=0.01)


def split_relu_with_loops() -> None:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    u = nengo.Node(sine)
    relu = nengo.SpikingRectifiedLinear()
    a = nengo.Ensemble(90, 2, neuron_type=relu, max_rates=nengo.dists.Uniform(50, 100))
    network.config[a].block_shape = nengo_loihi.BlockShape((45,), (90,))
    b = nengo.Ensemble(40, 2)
    # nengo-loihi does not seed the stand-in of a passthrough node: with evaluation points given,
    # nothing about it is random.
    through, back = nengo.Node(size_in=2), node(2, 0.5)
    nengo.Connection(u, a, transform=[[1], [0]])
    nengo.Connection(a, through, eval_points=EVAL_POINTS, synapse=None)
    nengo.Connection(through, b)
    nengo.Connection(b, back)
    nengo.Connection(back, a)
    for target in (a, a.neurons, b, back):
        nengo.Probe(target)
    nengo.Probe(a.neurons[40:50:3], "voltage")
    nengo.Probe(a.neurons[[3, 44, 45, 80]])


def recurrent() -> None:
    a = nengo.Ensemble(80, 2, radius=1.2)
    kick = nengo.Node(lambda t: [1, 0] if t < 0.05 else [0, 0])
    nengo.Connection(kick, a)
    nengo.Connection(a, a, transform=[[1.0, 0.3], [-0.3, 1.0]], synapse=0.1)
    nengo.Probe(a, synapse=0.02)


def neurons_to_neurons() -> None:
    rng = np.random.RandomState(1)
    u = nengo.Node(sine)
    a, b = nengo.Ensemble(30, 1), nengo.Ensemble(20, 1)
    nengo.Connection(u, a)
    nengo.Connection(a.neurons[3:27:2], b.neurons, transform=1e-3 * rng.randn(20, 12))
    nengo.Connection(a.neurons[[20, 4]], b.neurons, transform=1e-3 * rng.randn(20, 2))
    nengo.Probe(b.neurons)


def probes_of_neurons() -> None:
    u = nengo.Node(sine)
    a = nengo.Ensemble(30, 1)
    nengo.Connection(u, a)
    nengo.Probe(a.neurons, "voltage")
    nengo.Probe(a.neurons, "input")
    nengo.Probe(a.neurons[5:20:4], "voltage")
    nengo.Probe(a.neurons[[8, 2]])
    nengo.Probe(a.neurons[::7], synapse=0.02)
    nengo.Probe(a, synapse=nengo.Alpha(0.01))


def neurons_to_host() -> None:
    rng = np.random.RandomState(0)
    u, a = nengo.Node(sine), nengo.Ensemble(90, 1, max_rates=nengo.dists.Uniform(200, 300))
    out, one = node(5), node(1)
    nengo.Connection(u, a)
    nengo.Connection(a.neurons, out, transform=rng.randn(5, 90), synapse=0.01)
    nengo.Connection(a.neurons, one, transform=rng.randn(1, 90), synapse=None)
    nengo.Connection(a, out[0], function=np.square)
    nengo.Probe(out)
    nengo.Probe(one)


def split_neurons_to_host() -> None:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    rng = np.random.RandomState(0)
    u, a, out = nengo.Node(sine), nengo.Ensemble(90, 1), node(5)
    network.config[a].block_shape = nengo_loihi.BlockShape((30,), (90,))
    nengo.Connection(u, a)
    nengo.Connection(a.neurons, out, transform=rng.randn(5, 90), synapse=None)
    nengo.Connection(a.neurons[10:70], out[:3], transform=rng.randn(3, 60), synapse=None)
    nengo.Probe(out)


def learning() -> None:
    u = nengo.Node(sine)
    a, out, error = nengo.Ensemble(50, 1), node(1), nengo.Node(size_in=1)
    nengo.Connection(u, a)
    learned = nengo.Connection(
        a, out, function=lambda _x: 0, learning_rule_type=nengo.PES(1e-3), synapse=0.01
    )
    nengo.Connection(out, error)
    nengo.Connection(u, error, transform=-1)
    nengo.Connection(error, learned.learning_rule)
    nengo.Probe(out)
    nengo.Probe(error)


def convolution() -> None:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    kernel = np.random.RandomState(1).uniform(-1, 1, (3, 3, 1, 4))
    filters = nengo.Convolution(4, (4, 4, 1), kernel_size=(3, 3), init=kernel)
    image = nengo.Ensemble(16, 1, gain=np.ones(16), bias=np.linspace(0, 3, 16))
    maps = nengo.Ensemble(16, 1, gain=np.full(16, 0.01), bias=np.full(16, 0.9))
    network.config[maps].block_shape = nengo_loihi.BlockShape((2, 1, 4), (2, 2, 4))
    nengo.Connection(image.neurons, maps.neurons, transform=filters, synapse=0.005)
    nengo.Probe(maps.neurons)
    nengo.Probe(maps.neurons, "voltage")


def host_ensemble() -> None:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    u = nengo.Node(sine)
    host, chip = nengo.Ensemble(40, 1), nengo.Ensemble(30, 1)
    network.config[host].on_chip = False
    nengo.Connection(u, host)
    nengo.Connection(host, chip)
    nengo.Connection(host.neurons[:10], chip.neurons, transform=np.full((30, 10), 1e-3))
    nengo.Probe(host)
    nengo.Probe(chip, synapse=0.01)


MAKERS = [
    feed_forward,
    nothing_on_the_host,
    split_relu_with_loops,
    recurrent,
    neurons_to_neurons,
    probes_of_neurons,
    neurons_to_host,
    split_neurons_to_host,
    learning,
    convolution,
    host_ensemble,
]


def run_both(
    make: Callable[[], None], simulator: Callable[..., Any], backend: str = "nengo-loihi"
) -> list[tuple[np.ndarray, np.ndarray]]:
    with nengo.Network(seed=1) as network:
        make()
    with simulator(network, seed=5) as theirs:
        for _ in range(STEPS):  # in one go, nengo-loihi would decode all steps in one product
            theirs.step()
    with spikeport.Simulator(network, backend=backend, seed=5) as ours:
        ours.run_steps(STEPS)
    return [(np.asarray(theirs.data[p]), ours.data[p]) for p in network.all_probes]


@pytest.mark.parametrize("make", MAKERS, ids=[make.__name__ for make in MAKERS])
def test_probes_equal_nengo_loihis_bit_for_bit(
    make: Callable[[], None], nengo_loihi_simulator: Callable[..., Any]
) -> None:
    for theirs, ours in run_both(make, nengo_loihi_simulator):
        assert np.array_equal(theirs, ours)
        assert np.ptp(theirs) > 0


@pytest.fixture
def single_precision() -> Iterator[None]:
    nengo.rc.set("precision", "bits", "32")
    yield
    nengo.rc.set("precision", "bits", "64")


@pytest.mark.slow
@pytest.mark.usefixtures("single_precision")
@pytest.mark.parametrize("make", [split_relu_with_loops, learning], ids=["loops", "learning"])
@pytest.mark.parametrize("backend", ["native", "nengo-loihi"])
def test_probes_with_a_host_in_single_precision_equal_nengo_loihis(
    make: Callable[[], None], backend: str, nengo_loihi_simulator: Callable[..., Any]
) -> None:
    for theirs, ours in run_both(make, nengo_loihi_simulator, backend):
        assert np.array_equal(theirs, ours)
        assert np.ptp(theirs) > 0


@pytest.mark.slow
def test_noise_on_the_chip_equals_nengo_loihis(
    nengo_loihi_simulator: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # spikeport has no option for noise: the builder's default is replaced for both.
    monkeypatch.setattr(
        nengo_loihi.builder.builder, "Preset10DecodeNeurons", lambda dt: NoisyDecodeNeurons(5, dt)
    )
    for theirs, ours in run_both(feed_forward, nengo_loihi_simulator):
        assert np.array_equal(theirs, ours)
    monkeypatch.undo()
    quiet = run_both(feed_forward, nengo_loihi_simulator)
    assert not np.array_equal(quiet[0][1], ours)


def filtered_state() -> None:
    ensemble = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node(sine), ensemble)
    for attribute in ("voltage", "input"):
        for synapse in (nengo.Lowpass(0.01), nengo.Alpha(0.01)):
            nengo.Probe(ensemble.neurons, attribute, synapse=synapse)


def test_filtered_voltages_and_currents_are_not_cut_to_whole_numbers(
    nengo_loihi_simulator: Callable[..., Any],
) -> None:
    # The one difference: nengo-loihi stores the output of its filter in an array of integers.
    for theirs, ours in run_both(filtered_state, nengo_loihi_simulator):
        assert np.array_equal(theirs, ours.astype(int))
        assert not np.array_equal(theirs, ours)
