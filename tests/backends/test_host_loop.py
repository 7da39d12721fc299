import dataclasses
from collections.abc import Callable
from pathlib import Path

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network

STEPS = 200


def test_an_image_from_disk_runs_like_a_fresh_one(loop: nengo.Network, tmp_path: Path) -> None:
    compilation = compile_network(loop)
    compilation.image.save(tmp_path / "image")
    loaded = ChipImage.load(tmp_path / "image")
    executions = [
        HostLoop(dataclasses.replace(compile_network(loop), image=image), chip, seed=1)
        for image in (compilation.image, loaded)
        for chip in [NengoLoihiChip(image, seed=1)]
    ]
    for execution in executions:
        for _ in range(STEPS):
            execution.step()
    for probe in loop.all_probes:
        fresh, stored = (execution.data(probe) for execution in executions)
        assert np.array_equal(fresh, stored)
        assert np.ptp(fresh) > 0
    totals = [execution.activity().totals() for execution in executions]
    assert totals[0] == totals[1]


def test_two_runs_from_one_image_do_not_share_state(loop: nengo.Network) -> None:
    image = compile_network(loop).image
    first, second = NengoLoihiChip(image, seed=1), NengoLoihiChip(image, seed=1)
    silence = np.zeros(0, int)
    for _ in range(50):
        first.step(silence, {})
    once = [second.step(silence, {}) for _ in range(50)]
    fresh = NengoLoihiChip(image, seed=1)
    again = [fresh.step(silence, {}) for _ in range(50)]
    for one, other in zip(once, again, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def settled(closed: bool) -> float:
    """What ``a`` settles at when driven with 0.5 and, if closed, with minus itself."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(100, 1)
        minus = nengo.Node(lambda _t, x: -x, size_in=1)
        nengo.Connection(nengo.Node(0.5), a)
        nengo.Connection(a, minus, synapse=0.01)
        if closed:
            nengo.Connection(minus, a, synapse=0.01)
        probe = nengo.Probe(a, synapse=0.05)
    with spikeport.Simulator(network, backend="nengo-loihi") as simulator:
        simulator.run(0.6)
        return float(simulator.data[probe][-200:].mean())


def test_feedback_through_the_host_closes_the_loop() -> None:
    # x = 0.5 - x has its rest at 0.25.
    assert settled(closed=False) == pytest.approx(0.5, abs=0.05)
    assert settled(closed=True) == pytest.approx(0.25, abs=0.05)


def test_the_host_sees_the_chip_one_step_later_and_the_chip_the_host() -> None:
    seen: list[float] = []

    def watch(t: float, x: np.ndarray) -> None:
        if t > 0:  # Nengo calls it once before, to see what it returns
            seen.append(float(x[0]))

    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(1, 1, gain=[1.0], bias=[100.0])
        out = nengo.Node(watch, size_in=1)
        nengo.Connection(a.neurons, out, synapse=None)
        probe = nengo.Probe(a.neurons)
    with spikeport.Simulator(network, backend="nengo-loihi") as simulator:
        simulator.run_steps(50)
        spikes = simulator.data[probe][:, 0]
    assert spikes.any()
    assert seen == [0.0, *spikes[:-1]]


def test_recorded_data_can_be_read_while_running_and_after_closing(loop: nengo.Network) -> None:
    probe = loop.all_probes[0]
    with spikeport.Simulator(loop, backend="nengo-loihi", seed=1) as simulator:
        simulator.run_steps(100)
        half = simulator.data[probe]
        simulator.run_steps(100)
    assert np.array_equal(simulator.data[probe][:100], half)
    with spikeport.Simulator(loop, backend="nengo-loihi", seed=1) as whole:
        whole.run_steps(200)
    assert np.array_equal(whole.data[probe], simulator.data[probe])


def test_another_time_step_is_used_throughout(
    nengo_loihi_simulator: Callable[..., object], loop: nengo.Network
) -> None:
    with spikeport.Simulator(loop, backend="nengo-loihi", dt=0.002, seed=1) as simulator:
        simulator.run(0.1)
        assert simulator.image is not None
        assert simulator.image.manifest.dt_s == 0.002
        assert simulator.activity.dt_s == 0.002
    assert set(np.unique(simulator.data[loop.all_probes[1]])) == {0.0, 500.0}
    assert len(simulator.data[loop.all_probes[0]]) == 50
