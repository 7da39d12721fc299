"""The log of counts: memory that does not grow, and the files that keep every step."""

import tracemalloc

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.backends import step_log
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.step_log import (
    MESSAGES,
    LogOptions,
    MessageCounts,
    StepLog,
    Totals,
    counts_files,
)
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models import step_time
from spikeport.hardware_models.activity import PER_STEP

BACKENDS = ["native", "nengo-loihi", "reference"]
KEPT = 50


@pytest.fixture
def network():
    with nengo.Network(seed=2) as network:
        source = nengo.Node(lambda t: np.sin(30 * t))
        a, b = nengo.Ensemble(30, 1), nengo.Ensemble(20, 1)
        nengo.Connection(source, a)
        nengo.Connection(a, b)
        nengo.Probe(b)
    return network


@pytest.fixture
def kept_steps(monkeypatch):
    monkeypatch.setattr(step_log, "KEPT_STEPS", KEPT)


@pytest.mark.parametrize("backend", BACKENDS)
def test_counts_of_a_run_are_the_same_with_folded_steps(network, backend, monkeypatch):
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run_steps(120)
    monkeypatch.setattr(step_log, "KEPT_STEPS", KEPT)
    with spikeport.Simulator(network, backend=backend) as folded:
        folded.run_steps(120)
    assert folded.activity.folded.n_steps == 100
    assert folded.activity.n_steps == sim.activity.n_steps == 120
    assert folded.activity.totals() == sim.activity.totals()
    assert folded.activity.from_host == sim.activity.from_host
    assert folded.activity.from_host.total == (0 if backend == "reference" else 119)
    np.testing.assert_array_equal(folded.activity.spikes, sim.activity.spikes[100:])


def test_a_report_is_the_same_with_folded_steps(network, monkeypatch):
    with spikeport.Simulator(network) as sim:
        sim.run_steps(120)
    monkeypatch.setattr(step_log, "KEPT_STEPS", KEPT)
    with spikeport.Simulator(network) as folded:
        folded.run_steps(120)
    for name, found in folded.report()["timing"].items():
        wanted = sim.report()["timing"][name]
        assert found["worst"] == wanted["worst"]
        assert found["worst_step"] == wanted["worst_step"]
        assert found["mean"]["value"] == pytest.approx(wanted["mean"]["value"], rel=1e-12)


@pytest.mark.slow
def test_a_long_run_takes_no_more_memory_than_a_short_one(network, kept_steps):
    image = spikeport.compile_network(network).image
    chip = NativeChip(image, seed=0, log=LogOptions(chips.get("loihi")))
    no_spikes = np.zeros(0, dtype=int)

    def run(steps: int) -> int:
        for _ in range(steps):
            chip.step(no_spikes, {})
        return tracemalloc.get_traced_memory()[0]

    run(3 * KEPT)
    tracemalloc.start()
    try:
        short = run(2 * KEPT)
        long = run(100 * KEPT)
    finally:
        tracemalloc.stop()
    counts = 8 * len(PER_STEP) * image.n_cores * 100 * KEPT  # if every step were kept
    assert long - short < counts / 2  # NumPy keeps small blocks for later


def test_no_step_waits_for_more_than_a_piece_to_be_folded(monkeypatch):
    monkeypatch.setattr(step_log, "KEPT_STEPS", KEPT)
    monkeypatch.setattr(step_log, "PIECE", 10)
    folded, messages_of_pieces = [], []

    def fold(activity, chip):
        folded.append(len(activity.spikes))
        messages_of_pieces.append(activity.kept.messages.item())
        return step_time.fold(activity, chip)

    monkeypatch.setattr(step_log, "fold", fold)
    messages = np.array([[7]]), np.array([3])
    log = StepLog(("a",), 0.001, lambda: Totals(MessageCounts(*messages), 5))
    for step in range(1, 2 * KEPT + 21):
        folded.clear()
        log.append(np.full((len(PER_STEP), 1), step), step % 4)
        assert sum(folded) == (10 if step > KEPT and step % 10 == 0 else 0), step
    found = log.activity()
    assert found.folded.n_steps == 2 * KEPT
    assert found.spikes.ravel().tolist() == list(range(101, 121))
    assert found.over_steps("spikes") == sum(range(121))
    # The totals do not grow after the first fold, over whose pieces they are spread evenly.
    assert messages_of_pieces == pytest.approx([1.4] * 5 + [0.0] * 5)
    assert (found.messages, found.messages_host, found.readout_spikes) == (*messages, 5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_folder_holds_the_counts_of_every_step(network, backend, monkeypatch, tmp_path):
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run_steps(120)
    monkeypatch.setattr(step_log, "KEPT_STEPS", KEPT)
    with spikeport.Simulator(network, backend=backend, counts=tmp_path) as folded:
        folded.run_steps(120)
    files = counts_files(tmp_path)
    assert [file.name for file in files] == [
        "counts-000000000000.npz",
        "counts-000000000050.npz",
        "counts-000000000100.npz",
    ]
    for name in (*PER_STEP, "host_spikes"):
        steps = np.concatenate([np.load(file)[name] for file in files])
        np.testing.assert_array_equal(steps, getattr(sim.activity, name))


def test_a_reset_run_replaces_its_counts(network, kept_steps, tmp_path):
    with spikeport.Simulator(network, counts=tmp_path) as sim:
        sim.run_steps(120)
        sim.reset()
        assert counts_files(tmp_path) == []
        assert not (tmp_path / MESSAGES).exists()
        sim.run_steps(20)
    (file,) = counts_files(tmp_path)
    assert len(np.load(file)["spikes"]) == 20


def test_the_counts_of_another_run_are_not_replaced(network, tmp_path):
    with spikeport.Simulator(network, counts=tmp_path) as sim:
        sim.run_steps(3)
    with pytest.raises(UsageError) as caught:
        spikeport.Simulator(network, counts=tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: holds the counts of another run; choose another folder"
    )
