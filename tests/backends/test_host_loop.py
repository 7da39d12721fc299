import dataclasses
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network
from tests.helpers.event_files import camera_network, process_of, random_events, write_events

STEPS = 200


@pytest.mark.slow
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
    """Return the settled value of ``a``, driven with 0.5 and, if closed, with minus itself."""
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


@pytest.mark.slow
def test_feedback_through_the_host_closes_the_loop() -> None:
    # x = 0.5 - x settles at 0.25.
    assert settled(closed=False) == pytest.approx(0.5, abs=0.05)
    assert settled(closed=True) == pytest.approx(0.25, abs=0.05)


def test_nan_on_the_host_is_warned_of_once() -> None:
    with nengo.Network(seed=1) as network:
        nengo.Ensemble(10, 1)
        grows, rest = (nengo.Node(size_in=1, label=label) for label in ("grows", "rest"))
        nengo.Connection(nengo.Node([1.0]), grows, synapse=None)
        nengo.Connection(grows, grows, transform=1e3, synapse=0)
        for sign in (1, -1):
            nengo.Connection(grows, rest, transform=sign, synapse=None)
        nengo.Probe(rest)
    with spikeport.Simulator(network) as sim:
        with pytest.warns(RuntimeWarning, match=r"NaN on the host since step 120 .*; cure: "):
            sim.run_steps(130)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            sim.run_steps(50)


def test_the_host_sees_the_spikes_of_the_chip_one_step_later() -> None:
    seen: list[float] = []

    def watch(t: float, x: np.ndarray) -> None:
        if t > 0:  # Nengo calls the function once before the run, to see what it returns
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


def test_the_chip_sees_the_spikes_of_the_host_one_step_later() -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        host = nengo.Ensemble(1, 1, gain=[1.0], bias=[3.0])
        network.config[host].on_chip = False
        a = nengo.Ensemble(1, 1, gain=[1.0], bias=[0.0])
        # A spike of the host is enough for a spike.
        nengo.Connection(host.neurons, a.neurons, transform=[[0.1]], synapse=None)
        probes = [nengo.Probe(one.neurons) for one in (host, a)]
    with spikeport.Simulator(network, backend="nengo-loihi") as simulator:
        simulator.run_steps(50)
        sent, seen = (np.flatnonzero(simulator.data[probe]) for probe in probes)
    assert len(sent) > 3
    assert seen.tolist() == (sent + 1).tolist()


@pytest.mark.slow
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


def test_a_time_step_other_than_1_ms_is_used_throughout(
    nengo_loihi_simulator: Callable[..., object], loop: nengo.Network
) -> None:
    with spikeport.Simulator(loop, backend="nengo-loihi", dt=0.002, seed=1) as simulator:
        simulator.run(0.1)
        assert simulator.image is not None
        assert simulator.image.manifest.dt_s == 0.002
        assert simulator.activity.dt_s == 0.002
    assert set(np.unique(simulator.data[loop.all_probes[1]])) == {0.0, 500.0}
    assert len(simulator.data[loop.all_probes[0]]) == 50


EVENTS = {
    "sparse": (random_events(400, last_us=79_999), {"channels_last": False}),
    # More events in a step than there are sources, and several of one source.
    "dense": (random_events(3_000, last_us=79_999), {"pool": (4, 4)}),
}


@pytest.mark.parametrize("backend", ["native", "nengo-loihi"])
@pytest.mark.parametrize("case", EVENTS)
def test_probes_of_a_network_with_a_camera_equal_those_of_nengo_loihi(
    case: str, backend: str, tmp_path: Path, nengo_loihi_simulator: Callable[..., Any]
) -> None:
    events, options = EVENTS[case]
    path = write_events(tmp_path / "camera.aedat", **events)
    network = camera_network(process_of(path, **options))
    with nengo_loihi_simulator(network) as theirs:
        for _ in range(100):
            theirs.step()
    with spikeport.Simulator(network, backend=backend, seed=5) as ours:
        ours.run_steps(100)
    for probe in network.probes:
        assert np.array_equal(theirs.data[probe], ours.data[probe])
        assert np.ptp(ours.data[probe]) > 0
    image = ours.compilation.image
    assert [(i.name, i.encoding.kind) for i in image.manifest.inputs] == [("camera", "spikes")]


def test_events_reach_a_network_as_written_a_compacted_one_and_float_nengo(tmp_path: Path) -> None:
    events, options = EVENTS["sparse"]
    path = write_events(tmp_path / "camera.events", **events)
    network = camera_network(process_of(path, **options))
    counts = []
    for backend, pipeline in (("native", "as_written"), ("native", "compact"), ("reference", None)):
        with spikeport.Simulator(network, backend=backend, pipeline=pipeline) as simulator:
            simulator.run_steps(100)
        spikes = [simulator.data[probe] != 0 for probe in network.probes[:2]]
        counts.append(sum(np.count_nonzero(part) for part in spikes))
    as_written, compact, reference = counts
    assert as_written == compact > 50
    assert as_written == pytest.approx(reference, rel=0.1)


def test_events_reach_the_chip_one_step_later_even_after_probes_are_cleared(tmp_path: Path) -> None:
    path = write_events(tmp_path / "c.events", t=[4_500, 4_600], y=[0, 0], x=[0, 1], p=[1, 1])
    found = []
    with spikeport.Simulator(camera_network(process_of(path))) as simulator:
        assert simulator.compilation.image.n_cores == 1
        for n_steps in (3, 2, 1, 5):
            simulator.run_steps(n_steps)
            simulator.clear_probes()
            found.append(simulator.activity.messages_host.sum())
    assert found == [0, 0, 2, 2]


@pytest.mark.parametrize("backend", ["native", "reference"])
def test_data_of_a_probe_without_samples_have_the_size_of_the_probe(
    loop: nengo.Network, backend: str
) -> None:
    sizes = [probe.size_in for probe in loop.all_probes]
    for probe in loop.all_probes:
        probe.sample_every = 0.05
    with spikeport.Simulator(loop, backend=backend) as simulator:
        simulator.run_steps(10)
        assert [simulator.data[probe].shape for probe in loop.all_probes] == [
            (0, size) for size in sizes
        ]
