"""Float blocks against nengo-loihi's own, and the measured cost of rounding."""

import threading
from collections.abc import Callable
from dataclasses import replace

import nengo
import numpy as np
import pytest
from nengo_loihi.builder import Model
from nengo_loihi.emulator import EmulatorInterface

from spikeport.backends import step_log
from spikeport.backends.float_chip import FloatChip
from spikeport.backends.loss import MeasuredLoss, causes, measure
from spikeport.backends.recorder import Recorder
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.blocks import IntegerBlocks
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.discretise import discretise
from spikeport.compile.loihi.extract import extract
from spikeport.compile.loihi.numbers import wanted
from spikeport.compile.loihi.numpy1 import numpy1_semantics
from spikeport.compile.pipeline import compile_network
from spikeport.errors import BackendError


def feedforward(seed: int = 2) -> nengo.Network:
    with nengo.Network(seed=seed) as network:
        stimulus = nengo.Node(lambda t: np.sin(20 * t), label="stimulus")
        a, b = (nengo.Ensemble(30, 1, label=label) for label in "ab")
        nengo.Connection(stimulus, a)
        nengo.Connection(a, b, function=np.square)
        nengo.Probe(b, label="out")
    return network


def recurrent() -> nengo.Network:
    """Return a network without input, whose biases let neurons spike by themselves."""
    rng = np.random.RandomState(3)
    with nengo.Network(seed=3) as network:
        bias = rng.uniform(0.5, 2, 20)
        a = nengo.Ensemble(20, 1, label="a", gain=np.ones(20), bias=bias)
        weights = rng.uniform(-0.2, 0.2, (20, 20))
        nengo.Connection(a.neurons, a.neurons, transform=weights, synapse=0.01)
        nengo.Probe(a.neurons, label="out")
    return network


def quiet(_what: str, _share: float | None) -> None:
    """Report no progress."""


def emulated(network: nengo.Network, n_steps: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return voltages and spikes of nengo-loihi's emulator on blocks before discretising."""
    model = Model(dt=0.001)
    model.seeds[network], model.seeded[network] = network.seed, True
    with numpy1_semantics():
        model.build(network, precompute=False, discretize=False)
    rows = []
    with EmulatorInterface(model, seed=0) as emulator:
        for _ in range(n_steps):
            emulator.step()
            state = emulator.compartment
            rows.append((state.voltage.copy(), state.spiked.copy()))
    return rows


def built(network: nengo.Network) -> IntegerBlocks:
    return discretise(build(Rewrite(network, Names(network)), 0.001))


def test_float_blocks_have_the_spikes_and_voltages_of_nengo_loihis() -> None:
    blocks, n_steps = built(recurrent()), 200
    chip = FloatChip(extract(blocks, "loihi"))
    silence = [np.zeros(0, dtype=int)] * n_steps
    ours = list(chip.run(wanted(blocks), silence))
    spikes = 0
    for (voltage, spiked), (their_voltage, their_spiked) in zip(
        ours, emulated(recurrent(), n_steps), strict=True
    ):
        assert np.array_equal(spiked, their_spiked)
        assert voltage == pytest.approx(their_voltage, abs=1e-4)  # theirs are float32
        spikes += spiked.sum()
    assert spikes > 100


def measured_of(network: nengo.Network, seconds: float = 0.3) -> MeasuredLoss:
    return measure(network, compile_network(network), seconds, seed=0, progress=quiet)


@pytest.fixture(scope="module")
def measured() -> MeasuredLoss:
    return measured_of(feedforward())


@pytest.mark.slow
def test_shares_sum_to_one_in_falling_order(measured: MeasuredLoss) -> None:
    shares = [part.share for part in measured.loss.parts]
    assert sum(shares) == pytest.approx(1)
    assert shares == sorted(shares, reverse=True)


def test_the_error_of_outputs_is_about_the_sum_of_its_causes(measured: MeasuredLoss) -> None:
    loss = measured.loss
    whole = np.sqrt(sum(part.output_error**2 for part in loss.parts))
    assert 0.2 * whole < loss.output_error < 5 * whole
    assert loss.floor < loss.output_error < 0.3
    assert measured.activity.n_steps == loss.n_steps == 300


def test_every_connection_and_ensemble_is_a_cause() -> None:
    found = [(c.object, c.what) for c in causes(extract(built(feedforward()), "loihi"))]
    weights = {"a": "the host", "a -> b": "a", "b": "a -> b", "b -> out": "b"}
    of_neurons = ("bias", "threshold", "current decay", "voltage decay")
    assert sorted(found) == sorted(
        [(name, f"weights from {source}") for name, source in weights.items()]
        + [(name, what) for name in weights for what in of_neurons]
    )


def test_causes_have_names_of_their_own() -> None:
    network = recurrent()
    with network:
        (a,) = network.ensembles
        nengo.Connection(a.neurons, a.neurons, transform=np.eye(20), synapse=0.01)
    found = [(c.object, c.what) for c in causes(extract(built(network), "loihi"))]
    assert {("a", "weights from a"), ("a", "weights from a (2)")} <= set(found)
    assert len(set(found)) == len(found)


@pytest.mark.slow
def test_the_network_error_includes_delays_of_relays_and_filters(measured: MeasuredLoss) -> None:
    """Beside rounding, relays and filters add delays that float Nengo does not have."""
    assert measured.loss.output_error < measured.loss.network_error < 0.6
    network = feedforward()
    compilation = compile_network(network, pipeline="compact")
    direct = measure(network, compilation, 0.3, 0, quiet).loss
    assert direct.network_error < measured.loss.network_error


def test_weights_that_are_rounded_more_cost_more() -> None:
    def network(big: float) -> nengo.Network:
        """Return a network whose weights share 8 bits with that of a source that is silent."""
        with nengo.Network(seed=1) as net:
            pre = nengo.Ensemble(9, 1, label="pre", gain=np.ones(9), bias=[0] + [2.0] * 8)
            post = nengo.Ensemble(1, 1, label="post", gain=np.ones(1), bias=[0.9])
            weights = [[big, *np.linspace(0.0002, 0.002, 8)]]
            nengo.Connection(pre.neurons, post.neurons, transform=weights, synapse=0.005)
            nengo.Probe(post.neurons)
        return net

    losses = [measured_of(network(big)).loss for big in (0.002, 0.2)]
    errors = [
        {(p.object, p.what): p.output_error for p in loss.parts}["post", "weights from pre"]
        for loss in losses
    ]
    assert errors[0] < 0.05 < errors[1]


@pytest.mark.slow
def test_inputs_that_lose_spikes_are_saturated() -> None:
    with nengo.Network(seed=1) as network:
        ensemble = nengo.Ensemble(20, 1, label="a")
        nengo.Connection(nengo.Node(lambda t: 3.0 * (t > 0.1005)), ensemble, synapse=None)
        nengo.Probe(ensemble)
    loss = measured_of(network, 0.4).loss
    # Two spikes in each of the last 300 of 400 steps.
    assert loss.saturated_inputs == {"nodes[0] -> a": 0.75}
    assert [hint.id for hint in loss.hints if hint.id == "SP408"] == ["SP408"]


def test_host_neurons_that_spike_more_than_once_are_not_saturated_inputs() -> None:
    with nengo.Network(seed=1) as network:
        network.config[nengo.Ensemble].set_param("on_chip", nengo.params.BoolParam("on_chip", True))
        rectified = nengo.SpikingRectifiedLinear()
        host = nengo.Ensemble(3, 1, neuron_type=rectified, gain=np.ones(3), bias=np.full(3, 2000.0))
        network.config[host].on_chip = False
        ensemble = nengo.Ensemble(3, 1, label="a")
        nengo.Connection(host.neurons, ensemble.neurons, transform=0.001 * np.eye(3))
        nengo.Probe(ensemble)
    assert measured_of(network, 0.2).loss.saturated_inputs == {}


@pytest.mark.slow
def test_a_run_with_folded_steps_has_the_same_energy_and_times(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Runs of 10,000 steps or more fold them: see `spikeport.backends.step_log`."""
    network = feedforward()
    compilation = compile_network(network)
    wanted = measure(network, compilation, 0.05, seed=0, progress=quiet)
    monkeypatch.setattr(step_log, "KEPT_STEPS", 20)
    found = measure(network, compilation, 0.05, seed=0, progress=quiet)
    (steps, folded) = (compilation.report.to_dict(one.activity) for one in (wanted, found))
    for name, energy in steps["energy"].items():
        step_j = energy["system"]["energy_step"]["value"]
        assert folded["energy"][name]["system"]["energy_step"]["value"] == pytest.approx(step_j)
    for name, times in steps["timing"].items():
        assert folded["timing"][name]["worst"]["value"] == pytest.approx(times["worst"]["value"])


@pytest.mark.slow
def test_the_loss_is_the_same_every_time(measured: MeasuredLoss) -> None:
    again = measured_of(feedforward()).loss
    assert replace(again, network_error=None) == replace(measured.loss, network_error=None)
    assert again.network_error == pytest.approx(measured.loss.network_error)  # float Nengo's


def refusal(network: nengo.Network, *stages: str) -> str:
    """Return the message of a refusal that comes after the given stages of work."""
    reported: list[str] = []
    compilation = compile_network(network)
    with pytest.raises(BackendError) as raised:
        measure(network, compilation, 0.01, 0, lambda what, _share: reported.append(what))
    assert reported == list(stages)
    return str(raised.value)


def test_networks_that_cannot_be_compared_are_refused_before_they_run() -> None:
    with nengo.Network(seed=1) as silent:
        nengo.Ensemble(5, 1)
    assert refusal(silent) == (
        "loss is measured on outputs of spikes, decoded values or voltages, and the network "
        "has none; add a probe"
    )
    with nengo.Network(seed=1) as learns:
        pre, out = nengo.Ensemble(5, 1), nengo.Node(lambda _t, x: None, size_in=1)
        learned = nengo.Connection(pre, out, learning_rule_type=nengo.PES())
        nengo.Connection(nengo.Node(0.1), learned.learning_rule)
    assert refusal(learns) == (
        "cannot measure the loss of a network that learns or has noise on the chip: "
        "every run differs; compile it without --loss"
    )


def test_an_error_relative_to_outputs_of_0_is_refused() -> None:
    with nengo.Network(seed=1) as network:
        # A neuron just below its threshold in float, which its rounded bias exceeds.
        one = nengo.Ensemble(5, 1, gain=np.ones(5), bias=np.full(5, 0.99999))
        nengo.Probe(one.neurons)
    with pytest.raises(BackendError, match="are 0 in floating point, but not on the chip"):
        measured_of(network, 0.5)
    one.bias = np.zeros(5)
    with pytest.raises(BackendError, match="are 0 in floating point, and on the chip"):
        measured_of(network, 0.5)


def test_read_outs_that_lose_every_spike_are_named_where_no_output_is_left() -> None:
    with nengo.Network(seed=1) as network:
        slow, bent = nengo.dists.Choice([60.0]), nengo.dists.Choice([-0.5])
        few = nengo.Ensemble(2, 1, max_rates=slow, intercepts=bent, encoders=[[1], [-1]])
        nengo.Connection(nengo.Node(0.9), few)
        nengo.Probe(few)
    with pytest.raises(BackendError, match=r"0 in floating .*; read-outs: SP406 .*or by more"):
        measured_of(network, 0.3)


def network_with(node: object) -> nengo.Network:
    with nengo.Network(seed=1) as network:
        ensemble = nengo.Ensemble(5, 1)
        nengo.Connection(nengo.Node(node, size_out=1), ensemble)
        nengo.Probe(ensemble)
    return network


def test_an_error_of_a_node_is_reported_with_its_step() -> None:
    network = network_with(lambda t: 1 / (t < 0.0045))
    raised, _, place = refusal(network, "running the network").partition(" (")
    assert raised == "step 5: the network raised ZeroDivisionError: division by zero"
    assert "test_loss.py, line " in place


def test_the_chip_is_freed_after_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    freed: list[Recorder] = []
    monkeypatch.setattr(Recorder, "close", lambda self: freed.append(self))
    refusal(network_with(lambda t: 1 / (t < 0.0045)), "running the network")
    assert len(freed) == 1


def test_an_error_in_the_float_run_alone_is_reported_with_its_step() -> None:
    """The first run takes ten steps, and the node can answer only twelve times in both runs."""
    answers, lock = iter(np.zeros(12)), threading.Lock()  # functions with a lock are not copied
    network = network_with(lambda _t: next(answers) if lock else 0.0)
    with pytest.warns(UserWarning, match="functions cannot be copied"):
        raised = refusal(network, "running the network")
    assert raised.startswith("float Nengo: step 3: the network raised StopIteration: ")


def test_the_float_run_starts_with_nodes_in_the_same_state_as_the_run_on_the_chip() -> None:
    """A node that can answer ten steps is asked for ten in each run."""
    answers = iter(np.zeros(11))
    assert measured_of(network_with(lambda _t: next(answers)), 0.01).loss.network_error is not None


class Once(nengo.Process):
    """A process that cannot be made anew once it has stepped."""

    def __init__(self, *steps: float) -> None:
        super().__init__(default_size_in=0, default_size_out=1)
        self.steps = list(steps)

    def make_step(self, *_args: object) -> Callable[[float], float]:
        if self.steps:
            raise RuntimeError("no step")

        def step(t: float) -> float:
            self.steps.append(t)
            return 0.0

        return step


def test_an_error_of_a_process_is_reported_with_its_run() -> None:
    for process, where in ((Once(0.0), "before step 1"), (Once(), "float Nengo")):
        words = refusal(network_with(process), "running the network")
        assert words.startswith(f"{where}: the network raised RuntimeError: no step (")
