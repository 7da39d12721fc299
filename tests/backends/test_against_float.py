"""The error of probes on the chip against float Nengo's run of the network as it was written."""

from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport import add_params
from spikeport.backends.against_float import error_against_float
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.pipeline import compile_network
from spikeport.errors import RefusedError
from tests.helpers.event_files import camera_network, process_of, random_events, write_events

N_STEPS = 200


def found(network: nengo.Network, **options: object) -> float | None:
    compilation = compile_network(network, **options)
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=0), seed=0)
    for _ in range(N_STEPS):
        loop.step()
    return error_against_float(network, network, loop, N_STEPS, seed=0)


def channel(source: object, **options: object) -> nengo.Network:
    """Return a network from an input through two ensembles, probed in the second."""
    with nengo.Network(seed=1) as network:
        first, second = nengo.Ensemble(60, 1), nengo.Ensemble(60, 1)
        nengo.Connection(nengo.Node(source), first)
        nengo.Connection(first, second)
        nengo.Probe(second, **options)
    return network


@pytest.mark.slow
def test_values_are_near_those_of_float_nengo() -> None:
    assert 0.001 < found(channel([0.7])) < 0.2
    assert 0.001 < found(channel([0.7]), pipeline="compact") < 0.2
    assert 0.001 < found(channel([0.7], sample_every=0.01, synapse=0.02)) < 0.3


def test_nothing_is_compared_where_no_probe_took_a_sample() -> None:
    assert found(channel([0.7], sample_every=0.5)) is None


def test_nothing_is_compared_where_all_values_are_0_in_float() -> None:
    with nengo.Network(seed=1) as network:
        # A neuron just below its threshold in float, which its rounded bias exceeds.
        one = nengo.Ensemble(5, 1, gain=np.ones(5), bias=np.full(5, 0.99999))
        nengo.Probe(one, synapse=0.02)
    assert found(network) is None


def test_a_transform_changed_after_compiling_shows_as_an_error() -> None:
    network = channel([0.7])
    compilation = compile_network(network)
    network.connections[1].transform = -1
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=0), seed=0)
    for _ in range(N_STEPS):
        loop.step()
    assert error_against_float(network, network, loop, N_STEPS, seed=0) == pytest.approx(2, abs=0.2)


def test_random_input_is_compared_only_with_a_seed() -> None:
    assert found(channel(nengo.processes.WhiteSignal(1.0, high=5))) is None
    assert found(channel(nengo.processes.WhiteSignal(1.0, high=5, seed=3))) < 0.5


def test_noise_of_ensembles_on_the_host_is_compared_only_with_a_seed() -> None:
    for noise in (nengo.processes.WhiteNoise(), nengo.processes.WhiteNoise(seed=3)):
        network = channel(0.5)
        add_params(network)
        first = network.ensembles[0]
        first.noise = noise
        network.config[first].on_chip = False
        assert (found(network) is None) == (noise.seed is None)


def test_probes_of_spikes_are_not_compared() -> None:
    network = channel(np.sin)
    network.probes.clear()
    with network:
        nengo.Probe(network.ensembles[0].neurons)
    assert found(network) is None


def test_a_camera_is_read_in_both_runs(tmp_path: Path) -> None:
    path = write_events(tmp_path / "few.events", **random_events(200, 50_000))
    assert 0.001 < found(camera_network(process_of(path))) < 0.8


def test_a_network_that_nengos_optimiser_fails_for_is_compared_all_the_same() -> None:
    """It merges slices of neurons with a negative step, and NumPy refuses their views."""
    network = channel(np.sin)
    with network:
        a, b, c = (nengo.Ensemble(20, 1) for _ in range(3))
        nengo.Connection(network.nodes[0], a)
        eye = [(i, i) for i in range(10)]
        options = {"transform": nengo.Sparse((10, 10), indices=eye, init=1e-3)}
        nengo.Connection(a.neurons[10:], b.neurons[:10], **options)
        nengo.Connection(b.neurons[10:], c.neurons[9::-1], **options)
        nengo.Connection(a.neurons[:10], c.neurons[:9:-1], **options)
    with pytest.raises(ValueError, match="strides"):
        nengo.Simulator(network, progress_bar=False)
    assert found(network) is not None


def test_the_refusal_of_a_network_says_how_not_to_compare() -> None:
    """Nengo finds no order for operators that need each other in the same step."""
    network = channel([0.7])
    with network:
        a, b = (nengo.Ensemble(5, 1) for _ in range(2))
        for pre, post in ((a, b), (b, a)):
            nengo.Connection(pre.neurons, post.neurons, transform=0.01 * np.eye(5), synapse=None)
    with pytest.raises(RefusedError, match=r"cycles.*, or do not compare: `simulate --no-float`"):
        found(network)
