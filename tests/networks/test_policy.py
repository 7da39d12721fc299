import itertools

import nengo
import numpy as np
import pytest

from spikeport.backends.host_loop import HostLoop
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.errors import UsageError
from spikeport.networks.activations import elu
from spikeport.networks.policy import (
    Layer,
    Ranges,
    exact,
    policy,
    record_ranges,
)
from spikeport.networks.solvers import Tied

HOLD_STEPS = 20
PASSES = "fuse,decode_path,scale_rows,merge_axons,split,pack"


def random_layers(sizes: tuple[int, ...], seed: int = 0) -> list[Layer]:
    rng = np.random.RandomState(seed)
    return [
        Layer(rng.randn(n, m) * 1.4 / np.sqrt(m), 0.2 * rng.randn(n))
        for m, n in itertools.pairwise(sizes)
    ]


def gait_like(n: int, n_samples: int, seed: int = 0) -> np.ndarray:
    """Return periodic observations at 50 Hz, with some noise."""
    rng = np.random.RandomState(seed)
    t = 0.02 * np.arange(n_samples)[:, np.newaxis]
    phase, size = rng.uniform(0, 2 * np.pi, n), rng.uniform(0.3, 1.2, n)
    return size * np.sin(3 * np.pi * t + phase) + 0.3 * rng.randn(n) + 0.1 * rng.randn(n_samples, n)


def driven(
    sizes: tuple[int, ...], n_samples: int, centre: float = 0.0
) -> tuple[nengo.Network, np.ndarray]:
    """Return a network that feeds observations to a policy, and the exact actions for these.

    Actions and values of units are the same for observations around any centre.
    """
    first, *others = random_layers(sizes)
    layers = [Layer(first.weights, first.bias - first.weights.sum(axis=1) * centre), *others]
    observations = gait_like(sizes[0], 1000) + centre
    with nengo.Network(label="driven", seed=1) as network:
        net = policy(layers, record_ranges(layers, observations))
        held = nengo.Node(lambda t: observations[int((t - 5e-4) / (HOLD_STEPS * 1e-3))])
        nengo.Connection(held, net.observation, synapse=None)
        network.probe = nengo.Probe(net.action)
    return network, exact(layers, observations[:n_samples])[-1]


def relative_error(network: nengo.Network, wanted: np.ndarray, passes: str) -> float:
    return error_of(compile_network(network, pipeline=passes), network.probe, wanted)


def error_of(compilation: Compilation, probe: nengo.Probe, wanted: np.ndarray) -> float:
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=1), seed=1)
    for _ in range(HOLD_STEPS * len(wanted)):
        loop.step()
    found = loop.data(probe)[HOLD_STEPS - 1 :: HOLD_STEPS]
    return float(np.std((found - wanted)[5:]) / np.std(wanted[5:]))


@pytest.mark.slow
def test_observations_far_from_zero_cost_no_accuracy() -> None:
    near, far = (
        relative_error(*driven((8, 12, 8, 4), 60, centre), PASSES) for centre in (0.0, 5.0)
    )
    # The sums differ in some bits, and a few spikes with them.
    assert far == pytest.approx(near, rel=0.05)


def test_a_bias_drives_no_neurons_of_its_sign_where_a_unit_is_always_negative() -> None:
    # z = 4 - x is below 0: the neurons above 0 have the least range, an eighth of the bias.
    layers = [Layer(-np.ones((2, 1)), np.full(2, 4.0)), Layer(np.ones((1, 2)), np.zeros(1))]
    observations = np.linspace(4.5, 14, 50)[:, np.newaxis]
    with nengo.Network(label="negative", seed=1) as network:
        net = policy(layers, record_ranges(layers, observations))
        held = nengo.Node(lambda _: observations[25])
        nengo.Connection(held, net.observation, synapse=None)
        network.probe = nengo.Probe(net.action)
    compilation = compile_network(network, pipeline=PASSES)
    loop = HostLoop(compilation, NativeChip(compilation.image, seed=1), seed=1)
    for _ in range(100):
        loop.step()
    wanted = exact(layers, observations[25:26])[-1].item()
    assert loop.data(network.probe)[50:].mean() == pytest.approx(wanted, abs=0.2)


def of_both_sides(n: int, m: int, rng: np.random.RandomState) -> Layer:
    """Return a layer whose outputs (n,) swap their halves when its inputs (m,) do."""
    near, far = rng.randn(2, n // 2, m // 2)
    return Layer(np.block([[near, far], [far, near]]), np.tile(rng.randn(n // 2), 2))


@pytest.mark.slow
def test_a_symmetric_policy_errs_alike_on_both_sides() -> None:
    rng = np.random.RandomState(0)
    layers = [of_both_sides(n, m, rng) for m, n in itertools.pairwise((4, 6, 8, 2))]
    observations = rng.randn(1, 4)
    both = np.concatenate((observations, np.roll(observations, 2, axis=1)))
    actions = []
    for observation in both:
        with nengo.Network(seed=1) as network:
            net = policy(layers, record_ranges(layers, both), seed=3)
            nengo.Connection(nengo.Node(observation), net.observation, synapse=None)
            probe = nengo.Probe(net.action)
        with nengo.Simulator(network, progress_bar=False) as sim:
            sim.run(0.1)
        actions.append(sim.data[probe])
    np.testing.assert_allclose(actions[1], np.roll(actions[0], 1, axis=1), atol=1e-9)
    assert np.ptp(actions[0][-1]) > 0.1


def test_exact_computes_a_network_with_elu() -> None:
    layers = random_layers((3, 4, 2))
    x = np.array([0.3, -0.2, 1.0])
    hidden = layers[0].weights @ x + layers[0].bias
    np.testing.assert_allclose(exact(layers, x)[0], hidden)
    h = np.where(hidden > 0, hidden, np.exp(hidden) - 1)
    np.testing.assert_allclose(exact(layers, x)[1], layers[1].weights @ h + layers[1].bias)
    np.testing.assert_allclose(elu(hidden), h)


def test_ranges_cover_the_recorded_values_and_have_a_floor() -> None:
    layer = Layer(np.eye(2), np.zeros(2))
    (ranges,) = record_ranges([layer, layer], np.array([[2.0, -0.3], [-3.0, 0.3]]), quantile=1)
    assert ranges.above.tolist() == [2.0, 0.5]
    assert ranges.below.tolist() == [3.0, 0.5]


def test_a_hidden_layer_without_ranges_is_refused() -> None:
    layers = [Layer(np.ones((2, 2)), np.zeros(2))] * 3
    ranges = record_ranges(layers, np.ones((4, 2)))
    with pytest.raises(UsageError, match=r"^1 ranges for 2 hidden layers; cure: record_ranges"):
        policy(layers, ranges[:1])


def test_units_are_at_threshold_at_zero() -> None:
    net = policy(random_layers((2, 3, 1)), [Ranges(np.ones(3), 2 * np.ones(3))])
    with nengo.Simulator(net, progress_bar=False) as simulator:
        for ensemble in net.all_ensembles:
            current = simulator.data[ensemble].bias
            at_threshold = 1.0 if isinstance(ensemble.neuron_type, nengo.LIF) else 0.0
            np.testing.assert_allclose(current, at_threshold, atol=1e-9)


def test_tied_decoders_are_least_squares_with_one_unknown() -> None:
    rates = np.random.RandomState(1).uniform(0, 100, (50, 4))
    values = rates.sum(axis=1, keepdims=True) * 0.02
    decoders, _ = Tied()(rates, values)
    np.testing.assert_allclose(decoders, np.full((4, 1), 0.02))


@pytest.mark.slow
def test_direct_decoding_errs_less_on_the_chip_than_relayed_decoding() -> None:
    network, wanted = driven((6, 10, 10, 4), n_samples=40)
    direct = relative_error(network, wanted, PASSES)
    relayed = relative_error(network, wanted, "fuse,decode_path{default=onoff},split,pack")
    assert direct < 0.35 < relayed


@pytest.mark.slow
def test_a_policy_of_the_papers_size_fits_on_18_cores_and_is_accurate() -> None:
    network, wanted = driven((69, 128, 128, 128, 19), n_samples=50)
    assert len(network.all_ensembles) == 768
    compilation = compile_network(network, pipeline=PASSES)
    assert len(compilation.report.cores) <= 18
    assert error_of(compilation, network.probe, wanted) < 0.3
