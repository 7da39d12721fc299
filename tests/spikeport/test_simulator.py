import gc
import multiprocessing
import os
import pickle
import threading
import warnings
from fractions import Fraction
from importlib import metadata
from pathlib import Path

import nengo
import numpy as np
import pytest
from nengo.exceptions import SimulatorClosed, ValidationError
from nengo.utils.progress import ProgressBar

import spikeport
from spikeport import Simulator, compile_network
from spikeport.backends import registry
from spikeport.backends.board.link import LinkOptions
from spikeport.backends.registry import BACKENDS
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.errors import BackendError, UsageError


def network(seed=1):
    with nengo.Network(seed=seed) as net:
        stimulus = nengo.Node(lambda t: np.sin(30 * t), label="stimulus")
        ensemble = nengo.Ensemble(30, 1, label="ensemble")
        nengo.Connection(stimulus, ensemble)
        net.value = nengo.Probe(ensemble, synapse=0.01)
        net.spikes = nengo.Probe(ensemble.neurons)
        net.stimulus = nengo.Probe(stimulus)
    return net


@pytest.fixture(params=sorted(set(BACKENDS) - {"board", "replay"}))  # in tests/backends/board
def backend(request):
    return request.param


@pytest.fixture
def sim(backend):
    with Simulator(network(), backend=backend) as sim:
        yield sim


def test_a_simulator_starts_at_step_0(sim):
    assert (sim.n_steps, sim.time, sim.dt, sim.closed) == (0, 0.0, 0.001, False)
    assert sim.trange().shape == (0,)


def test_step_run_steps_and_run_advance_alike(sim):
    sim.step()
    assert sim.n_steps == 1
    sim.run_steps(4)
    assert sim.n_steps == 5
    sim.run(0.015)
    assert sim.n_steps == 20
    assert sim.time == pytest.approx(0.02)


def test_a_time_is_rounded_to_whole_steps(sim):
    sim.run(0.0029)
    assert sim.n_steps == 3


def test_trange_is_the_time_after_each_step(sim):
    sim.run_steps(3)
    assert sim.trange() == pytest.approx([0.001, 0.002, 0.003])


def test_data_have_a_row_for_each_step_of_every_probe(sim):
    sim.run_steps(7)
    assert {data.shape for data in sim.data.values()} == {(7, 1), (7, 30)}
    assert len(sim.data) == 3


def test_a_probe_of_the_host_sees_the_time_of_its_step(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(5)
    assert sim.data[net.stimulus][:, 0] == pytest.approx(np.sin(30 * sim.trange()))


def test_data_stays_readable_after_close(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(40)
        before = {probe: np.array(data) for probe, data in sim.data.items()}
    assert sim.closed
    assert before.keys() == sim.data.keys()
    for probe, data in before.items():
        assert np.array_equal(sim.data[probe], data)


def test_a_closed_simulator_does_not_run(sim):
    sim.close()
    sim.close()
    for advance in (sim.step, lambda: sim.run(0.001), lambda: sim.run_steps(1)):
        with pytest.raises(SimulatorClosed, match=r"^Simulator cannot run because it is closed\.$"):
            advance()


def test_a_simulator_is_closed_even_if_closing_its_chip_fails(sim, monkeypatch):
    def close():
        raise BackendError("no counts")

    monkeypatch.setattr(sim._execution, "close", close)
    with pytest.raises(BackendError, match=r"^no counts$"):
        sim.close()
    assert sim.closed


def test_a_chip_is_closed_even_if_its_counts_cannot_be_read(monkeypatch):
    sim = Simulator(network())
    sim.run_steps(1)
    closed = []

    def activity():
        raise BackendError("no counts")

    monkeypatch.setattr(sim._execution, "activity", activity)
    monkeypatch.setattr(sim._execution, "close", lambda: closed.append("chip"))
    with pytest.raises(BackendError, match=r"^no counts$"):
        sim.close()
    assert (sim.closed, closed) == (True, ["chip"])


def test_a_simulator_whose_chip_cannot_be_opened_again_is_closed_with_its_data(sim, monkeypatch):
    sim.run_steps(3)

    def fail(*_):
        raise BackendError("the board is gone")

    monkeypatch.setattr(sim, "_open", fail)
    with pytest.raises(BackendError, match=r"^the board is gone$"):
        sim.reset()
    assert sim.closed
    assert len(sim.trange()) == 3
    assert all(len(rows) == 3 for rows in sim.data.values())
    with pytest.raises(SimulatorClosed):
        sim.step()


STEPS = "an integer from 0 to 1,000,000,000"
SECONDS = "a time in seconds from 0 to 1e+06"


@pytest.mark.parametrize(
    ("advance", "message"),
    [
        (lambda sim: sim.run(-1), f"time_in_seconds=-1: expected {SECONDS}"),
        (lambda sim: sim.run(-0.0001), f"time_in_seconds=-0.0001: expected {SECONDS}"),
        (lambda sim: sim.run(float("nan")), f"time_in_seconds=nan: expected {SECONDS}"),
        (lambda sim: sim.run(float("inf")), f"time_in_seconds=inf: expected {SECONDS}"),
        (lambda sim: sim.run(1e300), f"time_in_seconds=1e+300: expected {SECONDS}"),
        (lambda sim: sim.run("1"), f"time_in_seconds='1': expected {SECONDS}"),
        (lambda sim: sim.run_steps(-1), f"steps=-1: expected {STEPS}"),
        (lambda sim: sim.run_steps(2.5), f"steps=2.5: expected {STEPS}"),
        (lambda sim: sim.run_steps(10**9 + 1), f"steps=1000000001: expected {STEPS}"),
    ],
)
def test_a_run_of_impossible_length_is_refused(sim, advance, message):
    with pytest.raises(UsageError) as caught:
        advance(sim)
    assert str(caught.value) == message
    assert isinstance(caught.value, ValidationError)
    assert sim.n_steps == 0


@pytest.mark.parametrize(
    ("backend", "link", "idle", "other"),
    [
        ("native", LinkOptions(real_time=True), "real_time=True", "board"),
        ("replay", LinkOptions(replay="a.rec", hold=3), "hold=3", "board"),
        ("board", LinkOptions(replay="a.rec"), f"replay={Path('a.rec')!r}", "replay"),
    ],
)
def test_options_of_a_link_that_would_do_nothing_are_refused(
    backend: str, link: LinkOptions, idle: str, other: str
) -> None:
    """A run that seems to keep to the clock would not."""
    with pytest.raises(UsageError) as caught:
        Simulator(nengo.Network(), backend=backend, link=link)
    assert str(caught.value) == (
        f"link: LinkOptions({idle}) does nothing on backend '{backend}'; cure: leave it out, or "
        f'backend="{other}"'
    )


DT = "a time step in seconds, above 0 and finite"
SEED = "None, or an integer from 0 to 4294967295"
BAR = "a bool, or a ProgressBar of Nengo's"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"network": None}, "network=None: expected a nengo.Network"),
        ({"chip": 5}, "chip=5: expected the name of a chip, or the path of its TOML file"),
        ({"dt": 0}, f"dt=0: expected {DT}"),
        ({"dt": -0.001}, f"dt=-0.001: expected {DT}"),
        ({"dt": float("nan")}, f"dt=nan: expected {DT}"),
        ({"dt": "0.001"}, f"dt='0.001': expected {DT}"),
        ({"dt": True}, f"dt=True: expected {DT}"),
        (
            {"link": "unix:/x"},
            "link='unix:/x': expected a spikeport.backends.board.link.LinkOptions",
        ),
        ({"counts": 5}, "counts=5: expected None, or the path of a folder"),
        ({"dt": 10**400}, f"dt={10**400}: expected {DT}"),
        ({"pipeline": 5}, "pipeline=5: expected a Pipeline, its text, or None for the chip's"),
        ({"seed": -1}, f"seed=-1: expected {SEED}"),
        ({"seed": 2**32}, f"seed=4294967296: expected {SEED}"),
        ({"seed": 1.5}, f"seed=1.5: expected {SEED}"),
        ({"progress_bar": 5}, f"progress_bar=5: expected {BAR}"),
        ({"offload": "no"}, "offload='no': expected a bool"),
        ({"cache": "folder"}, "cache='folder': expected a spikeport.cache.Cache"),
        ({"hardware_options": 3}, "hardware_options=3: expected None, or a mapping"),
    ],
)
def test_an_argument_that_is_not_valid_is_refused(backend, arguments, message):
    with pytest.raises(UsageError) as caught:
        Simulator(**{"network": network(), "backend": backend, **arguments})
    assert str(caught.value) == message
    assert isinstance(caught.value, ValidationError)


@pytest.mark.parametrize("beneath", ["", "x", "x/y"])
def test_a_file_in_place_of_the_folder_of_counts_is_refused_before_the_compile(
    tmp_path, monkeypatch, beneath
):
    (file := tmp_path / "net.py").touch()
    monkeypatch.setattr(registry, "compile_network", None)
    with pytest.raises(UsageError) as caught:
        Simulator(network(), counts=file / beneath)
    assert str(caught.value) == f"counts {file / beneath}: {file} is no folder; choose another"
    assert file.is_file()


def test_the_largest_seed_of_a_network_is_refused_unless_the_simulator_has_a_seed():
    with nengo.Network(seed=2**32 - 1) as net:
        nengo.Ensemble(5, 1)
    with pytest.raises(UsageError, match=r"^network.seed=4294967295: expected a smaller one"):
        Simulator(net)
    Simulator(net, seed=3).close()


def test_a_time_step_may_be_a_fraction():
    with Simulator(network(), dt=Fraction(1, 1000)) as sim:
        sim.run_steps(3)
        assert sim.dt == 0.001


def test_a_run_with_an_invalid_progress_bar_is_refused_before_its_first_step(sim):
    with pytest.raises(UsageError) as caught:
        sim.run_steps(2, progress_bar="bar")
    assert str(caught.value) == f"progress_bar='bar': expected {BAR}"
    assert sim.n_steps == 0


def test_a_backend_that_is_not_a_name_is_refused():
    with pytest.raises(UsageError, match=r"unknown backend '\[\]'; choose from: "):
        Simulator(network(), backend=[])


@pytest.mark.parametrize("seed", [-1, 2**32, 1.5, "x", [1]])
def test_a_reset_to_an_invalid_seed_is_refused_and_changes_nothing(sim, seed):
    sim.run_steps(2)
    with pytest.raises(UsageError) as caught:
        sim.reset(seed)
    assert str(caught.value) == f"seed={seed!r}: expected {SEED}"
    sim.run_steps(1)
    assert sim.n_steps == 3


@pytest.mark.parametrize("every", [0, -1, float("nan"), 10**400, "x"])
def test_an_invalid_sample_interval_of_trange_is_refused(sim, every):
    with pytest.raises(UsageError) as caught:
        sim.trange(sample_every=every)
    assert str(caught.value) == (
        f"sample_every={every!r}: expected None, or a time in seconds above 0"
    )


def test_seeds_and_steps_may_be_numpy_numbers(backend):
    with Simulator(network(), backend=backend, seed=np.int64(3), dt=np.float32(0.001)) as sim:
        sim.run_steps(np.int32(4))
        assert sim.n_steps == 4


def test_a_simulator_refuses_to_go_on_after_a_failed_step_until_it_is_reset(backend):
    with nengo.Network(seed=0) as net:
        nengo.Connection(nengo.Node(lambda t: 1 / (t < 0.0025)), nengo.Ensemble(10, 1))
    with Simulator(net, backend=backend) as sim:
        with pytest.raises(ZeroDivisionError):
            sim.run_steps(10)
        with pytest.raises(BackendError, match=r"^step 3 was broken off, or another thread is"):
            sim.step()
        sim.reset()
        sim.run_steps(2)
        assert sim.n_steps == 2


def test_a_thread_cannot_step_while_another_is_in_a_step(backend):
    inside, go_on = threading.Event(), threading.Event()

    def slow(t):
        inside.set()
        go_on.wait(20)
        return t

    go_on.set()  # Nengo calls a node while it is made
    with nengo.Network(seed=0) as net:
        nengo.Connection(nengo.Node(slow), nengo.Ensemble(10, 1))
    with Simulator(net, backend=backend) as sim:
        inside.clear()
        go_on.clear()
        other = threading.Thread(target=sim.step)
        other.start()
        assert inside.wait(20)
        with pytest.raises(BackendError, match="another thread is in it"):
            sim.step()
        go_on.set()
        other.join()
        sim.step()  # any thread may step once the other is done
        assert sim.n_steps == 2


def test_a_simulator_cannot_be_pickled(sim):
    with pytest.raises(TypeError) as caught:
        pickle.dumps(sim)
    assert str(caught.value) == (
        "a Simulator cannot be pickled; save its image with sim.image.save(), or build the "
        "simulator in the process that runs it"
    )


def test_a_time_that_rounds_to_zero_steps_is_warned_of(sim):
    with pytest.warns(
        UserWarning, match=r"^0\.0004 s rounds to zero steps of 0\.001 s; nothing was run$"
    ):
        sim.run(0.0004)
    sim.run_steps(0)
    assert sim.n_steps == 0


def test_a_closed_simulator_is_not_opened_again(sim):
    sim.close()
    with pytest.raises(SimulatorClosed, match=r"^Cannot re-open after simulator is closed\.$"), sim:
        pass


def leave_open():
    Simulator(network(), backend="reference")
    gc.collect()


def test_a_simulator_that_nobody_closed_is_warned_of():
    with pytest.warns(ResourceWarning, match=r"^Simulator was deallocated while open; close it"):
        leave_open()


def test_neither_a_closed_simulator_nor_one_never_built_is_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ResourceWarning)
        Simulator(network(), backend="reference").close()
        with pytest.raises(UsageError, match="unknown backend"):
            Simulator(network(), backend="brd")
        gc.collect()


class Bar(ProgressBar):
    """Progress bar that keeps its last progress."""

    seen = None

    def update(self, progress):
        self.seen = (progress.name_during, progress.n_steps, progress.max_steps)

    def close(self):
        pass


def test_a_run_shows_its_progress_on_the_bar_that_it_is_given():
    shown, other = Bar(), Bar()
    with Simulator(network(), backend="reference", progress_bar=shown) as sim:
        sim.run(0.005)
        assert shown.seen == ("Simulating", 5, 5)
        sim.run_steps(3, progress_bar=other)
        sim.run_steps(4, progress_bar=False)
    assert (shown.seen, other.seen) == (("Simulating", 5, 5), ("Simulating", 3, 3))


def host_only():
    with nengo.Network(seed=1) as net:
        stimulus = nengo.Node(np.sin)
        ensemble = nengo.Ensemble(20, 1, neuron_type=nengo.Direct())
        nengo.Connection(stimulus, ensemble)
        net.value = nengo.Probe(ensemble, synapse=0.01)
    return net


def test_a_network_with_nothing_for_the_chip_runs_on_the_host_and_says_so():
    net = host_only()
    says_so = (
        r"^no ensemble of the network is on the chip \(0 of 1: 1 of neuron type Direct\): "
        "all of it runs on the host, in float Nengo$"
    )
    with pytest.warns(UserWarning, match=says_so) as warned:
        sim = Simulator(net)
    assert [one.filename for one in warned] == [__file__]
    sim.run_steps(20)
    first = np.array(sim.data[net.value])
    sim.reset()
    with sim, Simulator(net, backend="reference") as reference:
        for simulator in (sim, reference):
            simulator.run_steps(20)
    assert np.array_equal(sim.data[net.value], first)
    assert np.array_equal(sim.data[net.value], reference.data[net.value])
    assert sim.compilation is None


def test_a_network_with_nothing_for_the_chip_cannot_be_compiled():
    with pytest.raises(DoesNotFitError, match="no ensemble of the network is on the chip"):
        compile_network(host_only())


def test_data_do_not_have_the_probes_of_another_network(sim):
    with pytest.raises(KeyError):
        sim.data[network().value]


def test_the_caller_can_choose_the_time_step(backend):
    with Simulator(network(), backend=backend, dt=0.002) as sim:
        sim.run(0.01)
    assert (sim.n_steps, sim.dt) == (5, 0.002)
    assert sim.time == pytest.approx(0.01)


def test_the_seed_derives_from_the_networks_seed_unless_it_is_given(backend):
    with Simulator(network(seed=8), backend=backend) as sim:
        assert sim.seed == 9
    with Simulator(network(seed=8), backend=backend, seed=0) as sim:
        assert sim.seed == 0


def test_two_runs_are_equal_bit_for_bit(backend):
    def run():
        net = network()
        with Simulator(net, backend=backend) as sim:
            sim.run_steps(100)
        return sim.data[net.value], sim.data[net.spikes]

    (value, spikes), (value_again, spikes_again) = run(), run()
    assert np.array_equal(value, value_again)
    assert np.array_equal(spikes, spikes_again)
    assert spikes.any()


def test_activity_counts_the_steps_and_the_probed_spikes(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(100)
        assert sim.activity.n_steps == 100
        in_probe = np.count_nonzero(sim.data[net.spikes])
        counted = sim.activity.spikes.sum()  # of the ensemble: nothing else on the chip spikes
    assert counted == in_probe > 0


def test_the_image_is_that_of_compile_network():
    with Simulator(network()) as sim:
        assert sim.image.digest == compile_network(network()).image.digest


def test_the_report_has_costs_only_after_steps_were_run():
    with Simulator(network()) as sim:
        assert sim.report()["energy"] is sim.report()["timing"] is None
        sim.run_steps(3)
        report = sim.report()
    assert report["image_digest"] == sim.image.digest
    assert report["energy"].keys() == report["timing"].keys() > set()


def test_the_reference_has_neither_image_nor_report():
    with Simulator(network(), backend="reference") as sim:
        assert sim.image is None
        assert sim.compilation is None
        with pytest.raises(UsageError) as caught:
            sim.report()
    assert str(caught.value) == (
        "nothing of the network is compiled for a chip: there is no report"
    )


def test_an_unknown_backend_lists_the_backends():
    with pytest.raises(UsageError) as caught:
        Simulator(network(), backend="brd")
    assert str(caught.value) == f"unknown backend 'brd'; choose from: {', '.join(sorted(BACKENDS))}"


def test_an_unknown_chip_lists_the_chips():
    with pytest.raises(UsageError, match=r"^unknown chip 'lohi'; choose from: .*loihi"):
        Simulator(network(), chip="lohi")


def test_reset_repeats_the_run(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(60)
        first = sim.data[net.value].copy(), sim.data[net.spikes].copy(), sim.activity.totals()
        sim.reset()
        assert sim.n_steps == sim.time == 0
        assert len(sim.data[net.value]) == 0
        sim.run_steps(60)
        assert np.array_equal(first[0], sim.data[net.value])
        assert np.array_equal(first[1], sim.data[net.spikes])
        assert first[2] == sim.activity.totals()


def test_data_that_were_kept_aside_follow_a_reset_as_in_nengo(backend):
    net = network()
    with Simulator(net, backend=backend) as sim, nengo.Simulator(net, progress_bar=False) as theirs:
        for simulator in (sim, theirs):
            data = simulator.data
            simulator.run_steps(5)
            simulator.reset()
            simulator.run_steps(3)
            assert len(data[net.value]) == 3


def test_reset_keeps_the_image_and_takes_a_new_seed():
    with Simulator(network(), seed=3) as sim:
        image = sim.image
        sim.reset()
        assert sim.seed == 3
        sim.reset(seed=4)
        assert sim.seed == 4
        assert sim.image is image
    with pytest.raises(SimulatorClosed):
        sim.reset()


def test_cleared_probes_record_only_the_steps_afterwards(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(50)
        whole = sim.data[net.value].copy()
        sim.reset()
        sim.run_steps(20)
        sim.clear_probes()
        assert len(sim.data[net.value]) == 0
        sim.run_steps(30)
        assert np.array_equal(sim.data[net.value], whole[20:])


def test_a_probe_samples_as_nengo_does(backend):
    with network() as net:
        thin = nengo.Probe(net.ensembles[0], synapse=0.01, sample_every=0.003)
        full = nengo.Probe(net.ensembles[0], synapse=0.01)
    with Simulator(net, backend=backend) as sim, nengo.Simulator(net, progress_bar=False) as theirs:
        for simulator in (sim, theirs):
            simulator.run_steps(31)
        assert np.array_equal(sim.trange(0.003), theirs.trange(sample_every=0.003))
        assert len(sim.data[thin]) == len(theirs.data[thin]) == len(sim.trange(0.003))
        steps = np.round(sim.trange(0.003) / sim.dt).astype(int)
        assert np.array_equal(sim.data[thin], sim.data[full][steps - 1])


def test_the_simulator_is_registered_as_a_nengo_backend():
    (entry,) = metadata.entry_points(group="nengo.backends", name="spikeport")
    assert entry.load() is Simulator


def test_data_have_the_parameters_that_nengo_builds(backend):
    net = network()
    (ensemble,), connection = net.ensembles, net.connections[0]
    with Simulator(net, backend=backend) as sim, nengo.Simulator(net, progress_bar=False) as theirs:
        sim.step()
        for name in ("gain", "bias", "encoders"):
            mine = getattr(sim.data[ensemble], name)
            assert np.array_equal(mine, getattr(theirs.data[ensemble], name))
        if backend == "reference":
            assert np.array_equal(sim.data[connection].weights, theirs.data[connection].weights)
    assert sim.data[ensemble].gain.shape == (30,)
    with pytest.raises(KeyError, match=r"<Node .*>: no probe, ensemble .*='as_written'\"$"):
        sim.data[nengo.Node(0.0, add_to_container=False)]


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_encoders_and_full_weights_are_scaled_by_the_radius_as_in_nengo(pipeline):
    with nengo.Network(seed=1) as net:
        spikeport.add_params(net)
        wide, narrow, host = (nengo.Ensemble(20, 1, radius=r) for r in (2.0, 0.5, 4.0))
        net.config[host].on_chip = False
        full = [
            nengo.Connection(wide, post, solver=nengo.solvers.LstsqL2(weights=True))
            for post in (narrow, narrow[[0]])
        ]
        nengo.Connection(wide, host)
    sim, theirs = Simulator(net, pipeline=pipeline), nengo.Simulator(net, progress_bar=False)
    with sim, theirs:
        for ensemble in net.ensembles:
            nengos = theirs.data[ensemble].scaled_encoders
            np.testing.assert_allclose(sim.data[ensemble].scaled_encoders, nengos)
        for connection in full:
            mine, nengos = sim.data[connection].weights, theirs.data[connection].weights
            # Decoders are solved for the rates of the chip's neurons: weights are a quarter off.
            assert np.linalg.norm(mine - nengos) < 0.4 * np.linalg.norm(nengos)


def test_weights_have_nengos_units_for_all_connections_and_passes():
    with nengo.Network(seed=1) as net:
        spikeport.add_params(net)
        node, array = nengo.Node(0.5), nengo.networks.EnsembleArray(20, 2)
        chip, host = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        net.config[host].on_chip = False
        kept = nengo.Connection(host, chip)
        nengo.Connection(node, chip)
        nengo.Connection(node, array.input, transform=np.ones((2, 1)))
        nengo.Connection(array.output, host, transform=np.ones((1, 2)))
        nengo.Connection(chip, host)
        nengo.Connection(chip, array.ensembles[0], function=np.square)
        nengo.Connection(chip.neurons, array.ensembles[1].neurons, transform=np.eye(20) / 1e4)
        nengo.Connection(chip, array.ensembles[0], solver=nengo.solvers.LstsqL2(weights=True))
    written, compact = (Simulator(net, pipeline=passes) for passes in ("as_written", "compact"))
    with written, compact, nengo.Simulator(net, progress_bar=False) as theirs:
        for connection in net.all_connections:
            weights, nengos = written.data[connection].weights, theirs.data[connection].weights
            if nengos is not None:  # without a transform, Nengo has no weights for values of nodes
                assert weights.shape == nengos.shape
                # Decoders are solved for the rates of the chip's neurons: weights are a fifth off.
                assert np.linalg.norm(weights - nengos) < 0.25 * np.linalg.norm(nengos)
            if connection is not kept:  # passes replace the connection from the host
                np.testing.assert_allclose(compact.data[connection].weights, weights, atol=1e-12)
        assert np.array_equal(written.data[kept].weights, theirs.data[kept].weights)
        with pytest.raises(KeyError, match=r"use pipeline='as_written'\. A connection from an "):
            compact.data[kept]


def test_attributes_and_recordings_of_a_run_are_read_only(sim):
    sim.run_steps(3)
    sim.close()
    for name, value in (("dt", 0.002), ("n_steps", 0), ("time", 0.0)):
        with pytest.raises(AttributeError, match="no setter"):
            setattr(sim, name, value)
    for probe in sim.data:
        with pytest.raises(ValueError, match="read-only"):
            sim.data[probe][:] = 7
    assert list(sim.data) == sim.network.all_probes


def test_a_forked_process_goes_on_with_a_copy_of_the_simulator(backend):
    net = network()
    with Simulator(net, backend=backend) as sim:
        sim.run_steps(5)
        reader, writer = multiprocessing.get_context("fork").Pipe(duplex=False)
        child = os.fork()
        if child == 0:  # the child sends its data and exits: no test goes on here
            try:
                sim.run_steps(15)
                writer.send(sim.data[net.value].tobytes())
                os._exit(0)
            finally:
                os._exit(1)
        writer.close()  # without the child's end, the reader gets no data
        sim.run_steps(15)
        assert reader.recv() == sim.data[net.value].tobytes()
        assert os.waitpid(child, 0)[1] == 0


def test_a_chip_is_closed_even_if_its_recordings_cannot_be_read(sim, monkeypatch):
    closed = []
    monkeypatch.setattr(sim._execution, "close", lambda: closed.append("chip"))
    monkeypatch.setattr(type(sim.data), "freeze", lambda self: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        sim.close()
    assert (sim.closed, closed) == (True, ["chip"])


@pytest.mark.parametrize("name", ["counts-0.npz", "messages.npz"])
def test_a_folder_with_files_of_counts_is_refused(tmp_path, name):
    (tmp_path / name).write_text("the user's")
    with pytest.raises(UsageError, match="holds the counts of another run"):
        Simulator(network(), counts=tmp_path)
    assert (tmp_path / name).read_text() == "the user's"
