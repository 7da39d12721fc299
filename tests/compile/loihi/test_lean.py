"""Direct wiring, which merges equal columns and stores no zeros, and its inputs from the host."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi import ordered_model
from spikeport.compile.pipeline import compile_network


def wired(transform: np.ndarray, path: str) -> ChipImage:
    """Return the image of neurons wired to neurons by a path."""
    with nengo.Network(seed=5, label="wired") as network:
        spikeport.add_params(network)
        one = {"gain": nengo.dists.Choice([1.0]), "radius": 1.0}
        pre = nengo.Ensemble(12, 1, bias=np.linspace(1, 4, 12), label="pre", **one)
        post = nengo.Ensemble(9, 1, bias=np.linspace(0.5, 1.5, 9), label="post", **one)
        wire = nengo.Connection(pre.neurons, post.neurons, transform=transform, synapse=0.005)
        network.config[wire].decode_path = path
        nengo.Probe(post.neurons)
    return compile_network(network, pipeline="").image


def outputs(image: ChipImage) -> np.ndarray:
    chip = NativeChip(image, seed=0)
    return np.array([chip.step(np.array([]), {})[0].copy() for _ in range(200)])


TIED = np.repeat(np.random.RandomState(1).uniform(-0.2, 1, (9, 4)), 3, axis=1) / 300
SPARSE = np.eye(9, 12) / 100


@pytest.mark.parametrize(("transform", "axons", "weights"), [(TIED, 4, 36), (SPARSE, 9, 9)])
def test_direct_wiring_spikes_the_same_with_fewer_axons_and_weights(
    transform: np.ndarray, axons: int, weights: int
) -> None:
    before, after = (wired(transform, path) for path in ("auto", "direct"))
    assert len(before.in_axons.row) == 12
    assert len(after.in_axons.row) == axons
    assert len(after.synapses.weight) == weights
    assert outputs(before).sum() > 0
    np.testing.assert_array_equal(outputs(before), outputs(after))


def test_weights_that_are_all_zero_share_one_row() -> None:
    image = wired(np.zeros((9, 12)), "direct")
    assert len(image.in_axons.row) == 1
    assert len(image.synapses.weight) == 9
    assert not np.any(image.synapses.weight)


def test_an_input_of_the_host_whose_weights_are_all_zero_compiles() -> None:
    with nengo.Network(seed=5) as network:
        spikeport.add_params(network)
        post = nengo.Ensemble(9, 1)
        wire = nengo.Connection(nengo.Node([1.0]), post.neurons, transform=np.zeros((9, 1)))
        network.config[wire].decode_path = "direct"
    assert not np.any(compile_network(network, pipeline="").image.synapses.weight)


def test_values_of_the_host_drive_neurons_on_the_chip_without_a_relay() -> None:
    with nengo.Network(seed=5) as network:
        spikeport.add_params(network)
        host, post = nengo.Ensemble(10, 1), nengo.Ensemble(9, 1)
        network.config[host].on_chip = False
        nengo.Connection(nengo.Node(lambda t: 1 if t > 0.3 else -1), host)
        wire = nengo.Connection(host, post.neurons, transform=np.ones((9, 1)))
        network.config[wire].decode_path = "direct"
        probe = nengo.Probe(post.neurons)
    with spikeport.Simulator(network, pipeline="", progress_bar=False) as simulator:
        (entry,) = simulator.image.manifest.blocks
        simulator.run_steps(600)
    assert entry.kind == "ensemble"
    low_hz, high_hz = simulator.data[probe].reshape(3, 200, 9).mean(axis=1)[[0, 2]]
    assert np.all(low_hz < 80)
    assert np.all(high_hz > 120)


def test_a_function_that_is_zero_compiles_with_a_hint() -> None:
    with nengo.Network(seed=5) as network:
        a, b = (nengo.Ensemble(20, 1, label=label) for label in "ab")
        nengo.Connection(a, b, function=lambda x: 0)
    hints = compile_network(network, pipeline="decode_path").report.hints
    assert ("SP402", "b") in {(hint.id, hint.object) for hint in hints}


def read_one_by_one(pipeline: str) -> tuple[ChipImage, np.ndarray]:
    """Return the image of six probed ensembles that a pass fuses, and what the probes record."""
    with nengo.Network(seed=5) as network:
        stimulus = nengo.Node(lambda t: np.sin(20 * t))
        for _ in range(6):
            ensemble = nengo.Ensemble(20, 1)
            nengo.Connection(stimulus, ensemble)
            nengo.Probe(ensemble, synapse=0.01)
    with spikeport.Simulator(network, pipeline=pipeline, progress_bar=False) as simulator:
        simulator.run_steps(100)
        return simulator.image, np.array([simulator.data[probe] for probe in network.probes])


def test_a_probe_of_a_fused_ensemble_reads_the_neurons_of_that_ensemble_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    image, found = read_one_by_one("fuse")
    monkeypatch.setattr(ordered_model, "lean_read_out", lambda model, connection: None)
    whole, wanted = read_one_by_one("fuse")
    inputs = 6 * 2  # a pair of neurons on the host for each ensemble
    assert len(whole.in_axons.row) == 6 * 120 + inputs
    assert len(image.in_axons.row) == 6 * 20 + inputs
    np.testing.assert_array_equal(found, wanted)


def wired_throughout(path: str) -> nengo.Network:
    """Return a network in which one path is set for all connections.

    They end in neurons on the host, and in neurons on the chip by a matrix and by a convolution,
    one of whose two kernels is zero.
    """
    kernels = np.stack([np.full((3, 3, 1), 0.02), np.zeros((3, 3, 1))], axis=-1)
    with nengo.Network(seed=5) as network:
        spikeport.add_params(network)
        network.config[nengo.Connection].decode_path = path
        one = {"gain": nengo.dists.Choice([1.0]), "bias": nengo.dists.Choice([2.0])}
        pixels, post, host = (nengo.Ensemble(n, 1, **one) for n in (64, 72, 4))
        network.config[host].on_chip = False
        channels = (kernels, kernels[..., ::-1])
        for init in channels:
            kernel = nengo.Convolution(2, (8, 8, 1), kernel_size=(3, 3), init=init)
            nengo.Connection(pixels.neurons, post.neurons, transform=kernel, synapse=0.005)
        nengo.Connection(nengo.Node([0.5]), host.neurons, transform=np.ones((4, 1)))
        nengo.Connection(pixels.neurons, host.neurons, transform=np.ones((4, 64)) / 1e4)
        for ensemble in (post, host):
            nengo.Probe(ensemble.neurons, synapse=0.01)
    return network


def test_convolutions_and_neurons_on_the_host_are_wired_as_usual() -> None:
    found = []
    for path in ("auto", "direct"):
        network = wired_throughout(path)
        with spikeport.Simulator(network, pipeline="", progress_bar=False) as simulator:
            simulator.run_steps(100)
            found.append(np.hstack([simulator.data[probe] for probe in network.probes]))
    assert found[0].any(axis=0).all()
    np.testing.assert_array_equal(*found)
