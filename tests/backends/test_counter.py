"""Counts of a run, against a slow count from the objects of nengo-loihi's own emulator."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import nengo
import nengo_loihi
import numpy as np
import pytest

import spikeport
from spikeport.hardware_models.activity import PER_STEP, Activity
from tests.helpers.chip_files import chip_file

STEPS = 120


def closed_loop() -> None:
    u = nengo.Node(lambda t: np.sin(20 * t))
    a, b = nengo.Ensemble(30, 1), nengo.Ensemble(20, 1)
    back = nengo.Node(lambda _t, x: -0.5 * x, size_in=1)
    nengo.Connection(u, a)
    nengo.Connection(a, b)
    nengo.Connection(b.neurons, a.neurons, transform=np.full((30, 20), 1e-4))
    nengo.Connection(b, back)
    nengo.Connection(back, a)


def convolution() -> None:
    network = nengo.Network.context[-1]
    nengo_loihi.add_params(network)
    filters = nengo.Convolution(4, (4, 4, 1), kernel_size=(3, 3), init=np.ones((3, 3, 1, 4)))
    image = nengo.Ensemble(16, 1, gain=np.ones(16), bias=np.linspace(0, 3, 16))
    maps = nengo.Ensemble(16, 1, gain=np.full(16, 0.01), bias=np.zeros(16))
    network.config[maps].block_shape = nengo_loihi.BlockShape((2, 1, 4), (2, 2, 4))
    nengo.Connection(image.neurons, maps.neurons, transform=filters)


def learning() -> None:
    a = nengo.Ensemble(25, 2)
    out = nengo.Node(lambda _t, x: x, size_in=2)
    learned = nengo.Connection(a, out, learning_rule_type=nengo.PES())
    nengo.Connection(out, learned.learning_rule)


class SlowCount:
    """Follower of every spike of nengo-loihi's emulator, one by one, on blocks of some cores."""

    def __init__(
        self, network: nengo.Network, simulator: Callable[..., Any], block_core: np.ndarray
    ) -> None:
        self.sim = simulator(network)
        self.emulator = self.sim.sims["emulator"]
        self.blocks = list(zip(self.sim.model.blocks, block_core.tolist(), strict=True))
        n = int(block_core.max()) + 1
        self.core = {s: core for block, core in self.blocks for s in block.synapses}
        self.counts = {name: np.zeros((STEPS, n), int) for name in PER_STEP}
        self.messages = np.zeros((n, n), int)
        self.messages_host = np.zeros(n, int)
        self.sent: dict[Any, np.ndarray] = {}
        self.emulator.host2chip = self._listen(self.emulator.host2chip)

    def _listen(self, host2chip: Callable[..., None]) -> Callable[..., None]:
        def listening(spikes: list[Any], errors: list[Any]) -> None:
            self.now = {source: indices for source, _, indices in spikes}
            host2chip(spikes, errors)

        return listening

    def run(self) -> None:
        slices = self.emulator.block_info.slices
        for t in range(STEPS):
            before = self.emulator.compartment.spiked.copy()
            self.now: dict[Any, np.ndarray] = {}
            self.sim.step()
            for block, core in self.blocks:
                self._arrive(t, block, np.flatnonzero(before[slices[block]]), core)
                self._state(t, core, slices[block])
            for source, indices in self.sent.items():
                self._arrive(t, source, indices, None)
            self.sent = self.now
            self._synapses(t)

    def _arrive(self, t: int, source: Any, indices: np.ndarray, core: int | None) -> None:
        for i in indices:
            reached = {
                self.core[axon.target]
                for axon in source.axons
                if axon.map_spikes(np.array([i]))[0] is not None
            }
            for target in reached:
                self.counts["messages_in"][t, target] += 1
                if core is None:
                    self.messages_host[target] += 1
                else:
                    self.messages[core, target] += 1

    def _state(self, t: int, core: int, part: slice) -> None:
        state = self.emulator.compartment
        self.counts["spikes"][t, core] += state.spiked[part].sum()
        for i in range(part.start, part.stop):
            at_rest = not (
                state.bias[i]
                or state.spiked[i]
                or state.current[i]
                or state.voltage[i]
                or state.input[0, i]
            )
            self.counts["updates_inactive" if at_rest else "updates_active"][t, core] += 1

    def _synapses(self, t: int) -> None:
        for synapse, spikes in self.emulator.synapses.spikes_in.items():
            core = self.core[synapse]
            for spike in spikes:
                if synapse.axon_compartment_base(spike.axon_idx) is not None:
                    weights, _ = synapse.axon_weights_indices(spike.axon_idx, spike.atom)
                    self.counts["synaptic_operations"][t, core] += len(weights)
            if synapse.learning and (t + 1) % 4 == 0:  # weights change at every fourth step
                self.counts["learning_updates"][t, core] += sum(w.size for w in synapse.weights)


@pytest.mark.parametrize("passes", ["", "pack"])
@pytest.mark.parametrize(
    "make", [closed_loop, convolution, learning], ids=lambda make: make.__name__
)
def test_counts_equal_those_of_a_slow_count(
    make: Callable[[], None],
    passes: str,
    nengo_loihi_simulator: Callable[..., Any],
    tmp_path: Path,
) -> None:
    with nengo.Network(seed=2) as network:
        make()
    chip = chip_file(tmp_path / "chip.toml", pipeline=passes)
    with spikeport.Simulator(network, chip, backend="nengo-loihi", seed=5) as ours:
        ours.run_steps(STEPS)
        activity, block_core = ours.activity, ours.image.blocks.core
    slow = SlowCount(network, nengo_loihi_simulator, block_core)
    with slow.sim:
        slow.run()
    for name in PER_STEP:
        assert np.array_equal(getattr(activity, name), slow.counts[name]), name
    assert np.array_equal(activity.messages, slow.messages)
    assert np.array_equal(activity.messages_host, slow.messages_host)
    assert activity.spikes.any()
    assert activity.synaptic_operations.any()


def activity_of(make: Callable[[], None], steps: int = STEPS) -> Activity:
    with nengo.Network(seed=2) as network:
        make()
    with spikeport.Simulator(network, backend="nengo-loihi", seed=5) as simulator:
        simulator.run_steps(steps)
        return simulator.activity


def test_every_message_that_arrives_was_sent() -> None:
    activity = activity_of(closed_loop)
    assert activity.messages_in.sum() == activity.messages.sum() + activity.messages_host.sum()
    assert activity.messages_host.sum() > 0


def test_every_compartment_is_updated_in_every_step() -> None:
    activity = activity_of(closed_loop)
    updates = activity.updates_active + activity.updates_inactive
    # a, b, the 20 relays of a -> b, the on/off pair of b's read-out, all on one core
    assert np.array_equal(updates, np.full((STEPS, 1), 30 + 20 + 20 + 2))


def test_learning_updates_every_weight_at_every_fourth_step() -> None:
    activity = activity_of(learning)
    # 25 neurons onto the on and off compartments of 2 dimensions
    assert activity.learning_updates.sum() == STEPS // 4 * 25 * 4
    assert np.array_equal(np.flatnonzero(activity.learning_updates.any(axis=1)) % 4, [3] * 30)


def test_nothing_is_learned_without_a_learning_rule() -> None:
    assert activity_of(closed_loop).learning_updates.sum() == 0


def read_out(factor: float) -> Callable[[], None]:
    def make() -> None:
        u, a = nengo.Node(1.0), nengo.Ensemble(40, 1)
        nengo.Connection(u, a)
        nengo.Connection(a, nengo.Node(lambda _t, x: x, size_in=1), function=lambda x: factor * x)

    return make


def test_a_read_out_within_its_range_does_not_spike() -> None:
    assert activity_of(read_out(1.0)).readout_spikes == 0


def test_a_read_out_far_over_its_threshold_spikes() -> None:
    assert activity_of(read_out(100.0)).readout_spikes > 0


def test_activity_before_the_first_step_is_empty() -> None:
    activity = activity_of(closed_loop, steps=0)
    assert activity.n_steps == 0
    assert not any(activity.totals().values())


def test_a_network_without_connections_sends_nothing() -> None:
    activity = activity_of(lambda: nengo.Ensemble(10, 1))
    assert activity.spikes.sum() > 0
    assert activity.messages_in.sum() == activity.synaptic_operations.sum() == 0
