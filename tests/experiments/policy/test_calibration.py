"""The calibration of a small policy on the native backend."""

import dataclasses
import functools
import gc
import weakref
from contextlib import closing

import nengo
import numpy as np
import pytest

from spikeport.constants import DT_S
from spikeport.experiments.calibration import play_in
from spikeport.experiments.options import Options
from spikeport.experiments.policy.calibration import (
    HOLD,
    LAG,
    SETTLING,
    SLOW,
    STRIDE,
    Played,
    SpikingHalves,
    Walks,
    calibrated_policy,
    emphasise_slow,
    refit_lagged,
)
from spikeport.networks.policy import (
    Calibrated,
    Layer,
    PolicyOptions,
    Readout,
    exact,
    policy,
    record_ranges,
)
from spikeport.simulator import Simulator

OPTIONS = PolicyOptions(n_neurons=10)
SIZES = ((6, 10), (10, 10), (10, 4))


@pytest.fixture(scope="module")
def layers():
    rng = np.random.RandomState(0)
    return [Layer(rng.randn(n, m) * 1.2 / np.sqrt(m), 0.2 * rng.randn(n)) for m, n in SIZES]


TRIM = np.array([0.0, 0.02, 0.0, 0.0, 0.0, 0.0])


def walks(seed):
    return Walks(lambda policy: walk(400, seed), lambda policy: TRIM)


def walk(n_samples, seed):
    """Return observations at 200 Hz that swing at 1.5 Hz."""
    rng = np.random.RandomState(seed)
    t = 0.005 * np.arange(n_samples)[:, np.newaxis]
    return np.sin(3 * np.pi * t + np.arange(6)) + 0.02 * rng.randn(n_samples, 6)


@pytest.fixture(scope="module")
def ranges(layers):
    return record_ranges(layers, walk(400, 0))


@pytest.fixture(scope="module")
def compact():
    return Options(1.0, pipeline="compact")


@pytest.fixture(scope="module")
def refitted(layers, ranges, compact):
    return calibrated_policy(layers, ranges, OPTIONS, walk(400, 0), walks(2), compact)


def action_error(layers, ranges, calibrated):
    """Measure the action's error on the chip, on observations that the refit did not use."""
    shown = walk(200, 1)
    with nengo.Network(seed=1) as network:
        net = policy(layers, ranges, OPTIONS, calibrated=calibrated)
        play_in(net.observation, shown, 5, 0.001)
        probe = nengo.Probe(net.action)
    with Simulator(network, pipeline="compact") as sim:
        sim.run_steps(5 * len(shown))
        found = sim.data[probe][4::5]
    trimmed = shown + (calibrated.trim if calibrated else 0.0)
    wrong = found[LAG:] - exact(layers, trimmed)[-1][:-LAG]
    return float(np.sqrt(np.mean(wrong[SETTLING:] ** 2)))


@pytest.mark.slow
def test_the_refitted_readout_is_nearer_to_the_exact_action(layers, ranges, refitted):
    nominal = action_error(layers, ranges, None)
    assert action_error(layers, ranges, Calibrated(**refitted.decoders)) < 0.8 * nominal


def test_a_robot_walks_on_the_first_refit_and_its_trim_is_found_on_the_kept_one(
    layers, ranges, compact, monkeypatch
):
    halves, found = [], {}
    give = SpikingHalves.__call__

    def watched(self, observation):
        halves.append(give(self, observation))
        return halves[-1]

    def walked(name, policy):
        halves.clear()
        actions = np.array([policy(observation) for observation in walk(200, 1)])
        found[name] = np.array(halves), actions

    def observe(policy):
        walked("first", policy)
        return walk(400, 2)

    def trim(policy):
        walked("kept", policy)
        return TRIM

    monkeypatch.setattr(SpikingHalves, "__call__", watched)
    shown = layers, ranges, OPTIONS, walk(400, 0)
    decoders = calibrated_policy(*shown, Walks(observe, trim), compact).decoders
    wanted = exact(layers, walk(200, 1))[-1]
    for name, (given, actions) in found.items():
        wrong = actions[LAG:] - wanted[:-LAG]
        assert np.std(wrong[SETTLING:]) < 0.3 * np.std(wanted)
        same = np.allclose(actions, given @ decoders["weights"].T + decoders["bias"], atol=1e-9)
        assert same is (name == "kept")
    assert (decoders["trim"] == TRIM).all()


def test_the_refit_also_uses_the_observations_of_the_robots_walk(layers, ranges, compact, refitted):
    other = calibrated_policy(layers, ranges, OPTIONS, walk(400, 0), walks(3), compact)
    assert other.image_digest == refitted.image_digest
    assert (other.decoders["weights"] != refitted.decoders["weights"]).any()


def test_a_refit_with_the_same_arguments_gives_the_same_decoders(layers, ranges, compact, refitted):
    again = calibrated_policy(layers, ranges, OPTIONS, walk(400, 0), walks(2), compact)
    assert again.image_digest == refitted.image_digest
    assert (again.decoders["weights"] == refitted.decoders["weights"]).all()
    assert (again.decoders["bias"] == refitted.decoders["bias"]).all()


def test_the_filter_keeps_constant_values_and_lessens_fast_swings():
    t = np.arange(20 * STRIDE)[:, np.newaxis]
    swings = np.sin(2 * np.pi * t / 20)
    np.testing.assert_allclose(emphasise_slow(np.full_like(swings, 5.0)), 5.0)
    np.testing.assert_allclose(
        emphasise_slow(swings)[STRIDE:-STRIDE], swings[STRIDE:-STRIDE] / SLOW, atol=1e-9
    )


def test_a_refit_prefers_slow_values_to_fast_ones():
    t = np.arange(2000)[:, np.newaxis]
    slow, fast = np.sin(2 * np.pi * t / 1000), np.sin(2 * np.pi * t / 20)
    readout = refit_lagged(Readout(np.zeros((1, 1)), np.zeros(1)), Played(slow + fast, slow))
    # 0.5 would be the least sum of squares if both counted the same
    assert readout.weights[0, 0] > 0.98


@pytest.mark.slow
def test_readout_and_trim_are_part_of_the_image(layers, ranges, refitted):
    digests = set()
    kept = Calibrated(**refitted.decoders)
    for calibrated in (None, kept, dataclasses.replace(kept, trim=0.0)):
        with nengo.Network(seed=1) as network:
            nengo.Probe(policy(layers, ranges, OPTIONS, calibrated=calibrated).action)
        with Simulator(network, pipeline="compact") as sim:
            digests.add(sim.image.digest)
    assert len(digests) == 3


def test_no_simulation_outlives_its_calibration(layers, ranges, compact):
    spiking = SpikingHalves(functools.partial(policy, layers, ranges, OPTIONS), 20, compact)
    simulation = weakref.ref(spiking._sim)
    spiking.close()
    del spiking
    gc.collect()
    assert simulation() is None


@pytest.mark.slow
def test_halves_are_read_in_the_last_step_of_each_held_observation(layers, ranges, compact):
    build, shown = functools.partial(policy, layers, ranges, OPTIONS), walk(12, 1)
    with closing(SpikingHalves(build, 20, compact)) as spiking:
        found = spiking.play(shown)
    with nengo.Network() as network:
        built = build(calibrated=Calibrated(np.eye(20), np.zeros(20)))
        play_in(built.observation, shown, HOLD, DT_S)
        probe = nengo.Probe(built.action)
    with Simulator(network, pipeline="compact") as sim:
        sim.run_steps(len(shown) * HOLD)
    np.testing.assert_array_equal(found, sim.data[probe][HOLD - 1 :: HOLD])


@pytest.mark.slow
def test_halves_are_the_positive_and_the_negative_part_of_the_activation(layers, ranges):
    build = functools.partial(policy, layers, ranges, OPTIONS)
    run = Options(1.0, backend="reference")
    shown = np.tile(walk(1, 2), (60, 1))
    with closing(SpikingHalves(build, 20, run)) as spiking:
        halves = spiking.play(shown)
    z = exact(layers, shown[0])[1]
    wanted = np.concatenate([np.maximum(z, 0), np.expm1(np.minimum(z, 0))])
    assert spiking.image_digest == ""
    assert halves[30:].mean(axis=0) == pytest.approx(wanted, abs=0.12)
