import itertools
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.expected import ALL, HOST, Rates, expected_activity
from spikeport.compile.image.fanout import fanout
from spikeport.compile.image.modules import by_module
from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.timing import timing


@pytest.fixture(scope="module")
def wired() -> ChipImage:
    """Return an image of 4 neurons with bias, each wired to all of 6 neurons without bias."""
    with nengo.Network(seed=5) as network:
        one, none = nengo.dists.Choice([1.0]), nengo.dists.Choice([0.0])
        pre = nengo.Ensemble(4, 1, label="pre", gain=one, bias=one)
        post = nengo.Ensemble(6, 1, label="post", gain=one, bias=none)
        nengo.Connection(pre.neurons, post.neurons, transform=np.ones((6, 4)), synapse=0.005)
    return compile_network(network, pipeline="").image


def test_expected_activity_agrees_with_a_count_by_hand(wired: ChipImage) -> None:
    activity = expected_activity(wired, Rates(100, {"post": 50}))
    pre, post = 4 * 100 * 0.001, 6 * 50 * 0.001
    assert activity.n_steps == 1
    assert activity.spikes.tolist() == [pytest.approx([pre, post])]
    assert activity.synaptic_operations.tolist() == [pytest.approx([0, pre * 6])]
    assert activity.messages.tolist() == [pytest.approx([0, pre]), [0, 0]]
    assert activity.messages_in.tolist() == [pytest.approx([0, pre])]
    assert activity.updates_active.tolist() == [[4, 6]]


def test_neurons_without_bias_that_no_spike_reaches_are_inactive(wired: ChipImage) -> None:
    activity = expected_activity(wired, Rates(0))
    assert activity.updates_active.tolist() == [[4, 0]]
    assert activity.updates_inactive.tolist() == [[0, 6]]
    assert activity.totals()["synaptic_operations"] == 0


def test_only_the_targets_of_spikes_are_active() -> None:
    with nengo.Network(seed=5) as network:
        one, none = nengo.dists.Choice([1.0]), nengo.dists.Choice([0.0])
        pre = nengo.Ensemble(2, 1, label="pre", gain=one, bias=one)
        post = nengo.Ensemble(6, 1, label="post", gain=one, bias=none)
        nengo.Connection(pre.neurons[:1], post.neurons[2:4], transform=np.ones((2, 1)))
    wired = compile_network(network).image
    activity = expected_activity(wired, Rates(0, {"pre": 100}))
    assert activity.updates_active.sum() == 2 + 2


def test_spikes_of_the_host_count_as_messages_from_the_host(image: ChipImage) -> None:
    activity = expected_activity(image, Rates(0, {HOST: 200}))
    per_spike = fanout(image)
    inputs = per_spike.messages[image.n_compartments :].sum(axis=0)
    assert activity.messages_host == pytest.approx(0.2 * inputs)
    assert activity.messages.sum() == 0


def test_sources_that_encode_values_spike_as_in_a_run_unless_their_rate_is_stated() -> None:
    with nengo.Network(seed=0) as network:
        ensemble = nengo.Ensemble(200, 8)
        nengo.Connection(nengo.Node([0.3] * 8), ensemble)
        nengo.Probe(ensemble)
    with Simulator(network) as sim:
        sim.run_steps(500)
        run, image = sim.activity, sim.image
    expected = expected_activity(image, Rates(100))
    for name in ("host_spikes", "messages_host"):
        # The sum of spikes of a pair of sources, on and off, does not depend on the value.
        in_a_step = getattr(run, name).sum() / run.n_steps
        assert getattr(expected, name).sum() == pytest.approx(in_a_step, rel=0.01)
    half = expected_activity(image, Rates(100, {HOST: 500}))
    assert half.host_spikes.sum() == pytest.approx(0.5 * image.n_inputs)


def test_a_rate_of_the_host_is_not_that_of_an_ensemble_called_host() -> None:
    with nengo.Network(seed=0) as network:
        ensemble = nengo.Ensemble(10, 1, label=HOST)
        nengo.Connection(nengo.Node([0.3]), ensemble)
    image = compile_network(network).image
    assert expected_activity(image, Rates(100)).spikes.sum() == pytest.approx(1)
    with pytest.raises(UsageError, match=r"rate of host: .* an ensemble has this name, too"):
        expected_activity(image, Rates(100, {HOST: 200}))


def test_the_rate_of_all_is_not_that_of_an_ensemble_called_all() -> None:
    with nengo.Network(seed=0) as network:
        nengo.Probe(nengo.Ensemble(10, 1, label=ALL))
    image = compile_network(network).image
    assert expected_activity(image, Rates(100)).spikes.sum() == pytest.approx(1)
    with pytest.raises(UsageError, match=r"rate of all: .* an ensemble has this name, too"):
        expected_activity(image, Rates(100, {ALL: 50}))


def learning(epoch: int) -> ChipImage:
    with nengo.Network(seed=0) as network:
        pre, post = nengo.Ensemble(50, 1, label="pre"), nengo.Node(size_in=2)
        rule = nengo.PES()
        learned = nengo.Connection(pre, post, learning_rule_type=rule, function=lambda x: [x, -x])
        nengo.Connection(nengo.Node([0.1, 0.2]), learned.learning_rule)
    image = compile_network(network).image
    rates = image.groups.learning.copy()
    rates[image.learns, image.manifest.learning.index("learn_epoch")] = epoch
    return replace(image, groups=replace(image.groups, learning=rates))


@pytest.mark.parametrize("epoch", [1, 4])
def test_learning_updates_are_those_of_a_run(epoch: int) -> None:
    image = learning(epoch)
    chip = NativeChip(image, seed=0)
    (group,) = np.flatnonzero(image.learns).tolist()
    for _ in range(8):
        chip.step(np.zeros(image.n_inputs), {group: np.zeros(2)})
    updates = chip.activity().learning_updates
    assert updates.sum() > 0
    expected, silent = (expected_activity(image, Rates(rate_hz)) for rate_hz in (100, 0))
    np.testing.assert_array_equal(expected.learning_updates, updates[:epoch])
    np.testing.assert_array_equal(np.tile(silent.learning_updates, (8 // epoch, 1)), updates)
    # Whatever the number of steps, counts of a step are the same.
    assert expected.over_steps("spikes").sum() / expected.n_steps == pytest.approx(50 * 0.1)
    assert expected.messages.sum() / expected.n_steps == pytest.approx(50 * 0.1)
    assert expected.from_host.mean == pytest.approx(expected.host_spikes[0])


def test_the_longest_step_is_one_in_which_weights_learn() -> None:
    image, loihi = learning(4), chips.get("loihi")
    taken = timing(expected_activity(image, Rates(100)), loihi, loihi.calibration("davies2018"))
    # 50 neurons with 4 weights each, at 6.1 ns; no other event differs from step to step.
    assert taken.worst_step == 3
    assert taken.worst.value - taken.mean.value == pytest.approx(0.75 * 200 * 6.1e-9)


def test_an_epoch_of_many_steps_counts_in_the_mean() -> None:
    expected = expected_activity(learning(2000), Rates(100))
    assert expected.n_steps == 1
    assert expected.learning_updates.sum() == pytest.approx(200 / 2000)


@pytest.mark.slow
def test_modules_of_large_networks_are_counted_within_little_memory() -> None:
    with nengo.Network(seed=0) as network:
        ensembles = [nengo.Ensemble(100, 1) for _ in range(100)]
        for pre, post in itertools.pairwise(ensembles):
            weights = nengo.Sparse((100, 100), indices=[(0, 0)], init=1e-3)
            nengo.Connection(pre.neurons, post.neurons, transform=weights)
    image = by_module(compile_network(network, pipeline="").image)
    tracemalloc.start()
    expected_activity(image, Rates(100))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2 * image.n_sources * image.n_cores  # two bytes for each source and module


def test_readouts_do_not_spike(image: ChipImage) -> None:
    read = image.readouts
    assert len(read) > 0
    spiking = image.n_compartments - len(read)
    assert expected_activity(image, Rates(1000)).totals()["spikes"] == pytest.approx(spiking)


def test_expected_counts_at_the_rates_of_a_run_are_those_of_the_run(wired: ChipImage) -> None:
    chip, n = NativeChip(wired, seed=0), 1000
    for _ in range(n):
        chip.step(np.array([]), {})
    run = chip.activity()
    counts = run.per_core()["spikes"]
    rates = Rates(0, {"pre": counts[0] / 4, "post": counts[1] / 6})
    expected = expected_activity(wired, rates)
    assert expected.spikes[0] * n == pytest.approx(counts)
    # one step passes between a spike and its arrival
    assert expected.synaptic_operations[0, 1] * n == pytest.approx(
        run.per_core()["synaptic_operations"][1], abs=4 * 6
    )


@pytest.mark.parametrize("rate", [-1, 1001, float("nan")])
def test_a_rate_that_no_neuron_can_have_is_refused(wired: ChipImage, rate: float) -> None:
    with pytest.raises(UsageError) as raised:
        expected_activity(wired, Rates(rate))
    assert str(raised.value) == (
        f"rate of all: {rate:g} Hz; a neuron spikes from 0 to 1000 times a second"
    )


def test_a_rate_for_an_unknown_ensemble_is_refused(wired: ChipImage) -> None:
    with pytest.raises(UsageError) as raised:
        expected_activity(wired, Rates(0, {"prae": 1}))
    assert str(raised.value) == "unknown ensemble 'prae'; choose from: host, post, pre"


def test_a_rate_of_a_readout_is_refused() -> None:
    """It would change nothing: read-outs hold values, and do not spike."""
    with nengo.Network(seed=1) as network:
        nengo.Probe(nengo.Ensemble(5, 1, label="a"))
    image = compile_network(network).image
    with pytest.raises(UsageError, match=r"unknown ensemble '.*'; choose from: a, host$"):
        expected_activity(image, Rates(0, {"a -> probes[0]": 100}))


def test_a_rate_holds_for_all_pieces_of_the_named_ensemble(
    convolution: Callable[..., nengo.Network],
) -> None:
    image = compile_network(convolution(), pipeline="").image
    activity = expected_activity(image, Rates(0, {"maps": 1000}))
    sizes = {block.label: 16 / 2 for block in image.manifest.blocks if block.owner == "maps"}
    assert len(sizes) == 2
    assert activity.totals()["spikes"] == pytest.approx(sum(sizes.values()))
