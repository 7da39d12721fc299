from typing import Any

import nengo
import numpy as np
import pytest
import scipy.sparse

import spikeport
from spikeport.compile.ground.refusal import RefusedError
from spikeport.hardware_models.activity import Activity

STEPS = 200


def run(
    network: nengo.Network, seed: int | None = 7, steps: int = STEPS, **options: str
) -> spikeport.Simulator:
    with spikeport.Simulator(network, backend="reference", seed=seed, **options) as simulator:
        simulator.run_steps(steps)
    return simulator


def test_probes_equal_those_of_plain_nengo(loop: nengo.Network) -> None:
    with loop:
        noise = nengo.Node(nengo.processes.WhiteNoise())  # takes the simulator's seed
        nengo.Probe(noise)
    ours = run(loop)
    with nengo.Simulator(loop, seed=7, progress_bar=False) as theirs:
        theirs.run_steps(STEPS)
    for probe in loop.all_probes:
        assert np.array_equal(ours.data[probe], theirs.data[probe])
        assert np.ptp(ours.data[probe]) > 0


def test_an_unseeded_network_runs_the_same_every_time() -> None:
    def data() -> np.ndarray:
        with nengo.Network() as network:
            probe = nengo.Probe(nengo.Ensemble(20, 1).neurons)
        return run(network, seed=None).data[probe]

    np.random.seed(1)
    first = data()
    np.random.seed(2)
    assert np.array_equal(first, data())
    assert first.any()


@pytest.fixture
def pair() -> tuple[Activity, np.ndarray, np.ndarray]:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1, label="a"), nengo.Ensemble(10, 1, label="b")
        nengo.Connection(a, b)
        nengo.Connection(a.neurons[:5], b.neurons, transform=np.ones((10, 5)))
        nengo.Connection(nengo.Node(0.3), a)
        probes = [nengo.Probe(ensemble.neurons) for ensemble in (a, b)]
    with spikeport.Simulator(network, backend="reference", seed=7) as simulator:
        simulator.run_steps(STEPS)
        activity = simulator.activity
    a_spikes, b_spikes = (simulator.data[probe] > 0 for probe in probes)
    return activity, a_spikes, b_spikes


def test_every_ensemble_is_a_core(pair: tuple[Activity, np.ndarray, np.ndarray]) -> None:
    activity, a_spikes, b_spikes = pair
    assert activity.cores == ("a", "b")
    assert np.array_equal(activity.spikes, np.stack([a_spikes.sum(1), b_spikes.sum(1)], axis=1))
    assert np.array_equal(activity.updates_active, np.tile([20, 10], (STEPS, 1)))


def test_a_spike_arrives_in_the_next_step_at_every_neuron_of_its_target(
    pair: tuple[Activity, np.ndarray, np.ndarray],
) -> None:
    activity, a_spikes, _ = pair
    arriving = np.concatenate([np.zeros((1, 20), int), a_spikes[:-1]])
    # Neurons 0 to 4 reach b's 10 neurons twice, decoded and directly, with one message.
    operations = 10 * arriving.sum(axis=1) + 10 * arriving[:, :5].sum(axis=1)
    assert np.array_equal(activity.synaptic_operations[:, 1], operations)
    assert np.array_equal(activity.messages_in[:, 1], arriving.sum(axis=1))
    assert activity.messages.tolist() == [[0, arriving.sum()], [0, 0]]
    assert activity.messages_host.tolist() == [0, 0]


@pytest.mark.parametrize("on_chip", [True, False])
def test_a_reset_runs_the_network_as_it_was_built(on_chip: bool) -> None:
    with nengo.Network(seed=1) as network:
        spikeport.add_params(network)
        ensemble = nengo.Ensemble(20, 1, noise=nengo.processes.WhiteNoise(scale=False))
        network.config[ensemble].on_chip = on_chip
        nengo.Connection(nengo.Node(0.3), ensemble)
        probe = nengo.Probe(ensemble, synapse=0.01)
    backend = "reference" if on_chip else "native"  # which has nothing on the chip
    with spikeport.Simulator(network, backend=backend) as simulator:
        simulator.run_steps(50)
        before, counts = simulator.data[probe].copy(), simulator.activity.totals()
        ensemble.seed, ensemble.max_rates = 7, nengo.dists.Choice([50])
        simulator.reset()
        assert simulator.activity.n_steps == 0
        simulator.run_steps(50)
        assert np.array_equal(simulator.data[probe], before)
        assert simulator.activity.totals() == counts


def test_a_network_without_neurons_runs() -> None:
    with nengo.Network(seed=1) as network:
        probe = nengo.Probe(nengo.Node(lambda t: t))
    simulator = run(network, steps=10)
    assert simulator.data[probe][:, 0] == pytest.approx(0.001 * np.arange(1, 11))
    assert simulator.activity.cores == ()
    assert simulator.activity.n_steps == 10
    assert not any(simulator.activity.totals().values())


def test_direct_ensembles_have_no_core() -> None:
    with nengo.Network(seed=1) as network:
        exact = nengo.Ensemble(1, 1, neuron_type=nengo.Direct())
        a = nengo.Ensemble(5, 1, label="a")
        nengo.Connection(exact, a)
    assert run(network).activity.cores == ("a",)


def test_fused_ensembles_are_fewer_cores_and_compute_the_same() -> None:
    with nengo.Network(seed=2) as network:
        source = nengo.Node(lambda t: np.sin(20 * t + np.arange(4)))
        layers = [[nengo.Ensemble(20, 1) for _ in range(4)] for _ in range(2)]
        for number, (first, second) in enumerate(zip(*layers, strict=True)):
            nengo.Connection(source[number], first, synapse=None)
            nengo.Connection(first, second, function=np.square, synapse=0.005)
        probes = [nengo.Probe(ensemble, synapse=0.01) for ensemble in layers[1]]
    found, blocks = [], []
    for pipeline in ("", "fuse"):
        with spikeport.Simulator(network, backend="reference", pipeline=pipeline) as simulator:
            simulator.run_steps(200)
            found.append(np.hstack([simulator.data[probe] for probe in probes]))
            blocks.append(len(simulator.activity.cores))
            assert simulator.data[layers[0][0]].gain.shape == (20,)
    assert found[1] == pytest.approx(found[0], abs=1e-9)
    assert blocks[1] < blocks[0] == 8


def test_a_spike_costs_as_much_in_a_fused_network() -> None:
    with nengo.Network(seed=1) as network:
        for number in range(5):
            first, second = nengo.Ensemble(20, 1), nengo.Ensemble(15, 2)
            nengo.Connection(nengo.Node([0.2 * number]), first)
            nengo.Connection(first, second, transform=[[0.1], [0.2]])
    written, fused = (run(network, pipeline=passes).activity for passes in ("", "fuse"))
    assert len(fused.cores) == 2
    assert written.totals()["spikes"] == fused.totals()["spikes"] > 0
    assert written.totals()["synaptic_operations"] == fused.totals()["synaptic_operations"]
    assert written.messages.sum() == fused.messages.sum()


def test_a_decoded_value_reaches_the_neurons_that_it_has_weights_to() -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 2), nengo.Ensemble(7, 1)
        nengo.Connection(a, b.neurons[[4, 0, 2]], transform=[[0, 0], [1, 0], [1, 1]])
    activity = run(network).activity
    sent = activity.messages.sum()
    assert activity.totals()["synaptic_operations"] == 2 * sent > 0


SPARSE = nengo.Sparse((4, 6), indices=[(0, 0), (3, 0), (1, 5)], init=0.1)
UNSORTED = scipy.sparse.csr_matrix((np.full(3, 0.1), [5, 0, 0], [0, 2, 2, 2, 3]), shape=(4, 6))


@pytest.mark.parametrize(
    ("transform", "n_pre", "reached"),
    [
        (0.1, 4, [1, 1, 1, 1]),
        (SPARSE, 6, [2, 0, 0, 0, 0, 1]),
        (nengo.Sparse((4, 6), init=UNSORTED), 6, [2, 0, 0, 0, 0, 1]),
        (np.eye(4, 6), 6, [1] * 4 + [0] * 2),
    ],
)
def test_a_spike_reaches_the_neurons_that_it_has_weights_to(
    transform: Any, n_pre: int, reached: list[int]
) -> None:
    with nengo.Network(seed=1) as network:
        ones = {"gain": np.ones(9), "bias": np.full(9, 5.0), "encoders": np.ones((9, 1))}
        a, b = nengo.Ensemble(9, 1, **ones), nengo.Ensemble(7, 1)
        pre, post = a.neurons[3 : 3 + n_pre], b.neurons[[6, 2, 1, 0]]
        nengo.Connection(pre, post, transform=transform)
        probe = nengo.Probe(pre)
    simulator = run(network)
    spikes = (simulator.data[probe][:-1] > 0).sum(axis=0)
    assert spikes.all()
    assert simulator.activity.totals()["synaptic_operations"] == spikes @ reached
    assert simulator.activity.messages.sum() == spikes @ (np.array(reached) > 0)


def test_a_network_that_nengo_refuses_is_refused_with_a_cure() -> None:
    with nengo.Network() as network:
        nengo.Ensemble(5, 1, intercepts=nengo.dists.Choice([1.5]), label="a")
    with pytest.raises(RefusedError, match=r"^ordinary Nengo refuses the network: The ") as caught:
        spikeport.Simulator(network, backend="reference")
    assert str(caught.value).endswith("to below 1; cure: change the network accordingly")


def around(synapse: nengo.synapses.Synapse | None) -> nengo.Network:
    """Return a loop of two ensembles, with a synapse in one of its connections."""
    with nengo.Network(seed=1) as network:
        a, b = (nengo.Ensemble(5, 1, label=label) for label in "ab")
        nengo.Connection(a.neurons, b.neurons, transform=0.01 * np.eye(5), synapse=None)
        nengo.Connection(b.neurons, a.neurons, transform=0.01 * np.eye(5), synapse=synapse)
    return network


def test_a_loop_that_nengo_refuses_has_a_cure_that_works() -> None:
    with pytest.raises(RefusedError, match="Input graph has cycles") as caught:
        spikeport.Simulator(around(None), backend="reference")
    assert str(caught.value).endswith(
        "; cure: give a connection of each loop a synapse, as in synapse=nengo.Lowpass(0.001) "
        "(`spikeport compile` names loops on the chip, SP416)"
    )
    hints = [str(hint) for hint in spikeport.compile_network(around(None)).report.hints]
    assert any(hint.startswith("b -> a: SP416 loop without a synapse") for hint in hints)
    run(around(nengo.Lowpass(0.001)), steps=2)


MANY = nengo.PoissonSpiking(nengo.LIFRate(tau_ref=0.0005), amplitude=0.5)


@pytest.mark.parametrize(
    "kind", [nengo.LIF(amplitude=3.0), nengo.Izhikevich(), nengo.AdaptiveLIF(), MANY]
)
def test_every_spike_is_counted_and_delivered(kind: nengo.neurons.NeuronType) -> None:
    with nengo.Network(seed=1) as network:
        options = {"max_rates": nengo.dists.Choice([1500 if kind is MANY else 200])}
        a, b = nengo.Ensemble(30, 1, neuron_type=kind, **options), nengo.Ensemble(7, 1)
        nengo.Connection(nengo.Node(0.9), a)
        nengo.Connection(a, b)
        probe = nengo.Probe(a.neurons)
    simulator = run(network)
    amplitude = getattr(kind, "amplitude", 1.0)
    spikes = np.rint(simulator.data[probe] * simulator.dt / amplitude).astype(int).sum(axis=1)
    activity = simulator.activity
    assert np.array_equal(activity.spikes[:, 0], spikes)
    assert spikes.sum() > 0
    assert np.array_equal(activity.synaptic_operations[1:, 1], 7 * spikes[:-1])
    assert activity.messages[0, 1] == spikes[:-1].sum()


def test_a_neuron_that_spikes_twice_in_a_step_is_counted_twice() -> None:
    with nengo.Network(seed=1) as network:
        kind = nengo.SpikingRectifiedLinear()
        one = {"gain": [1.0], "bias": [2500.0], "encoders": [[1.0]]}
        nengo.Ensemble(1, 1, neuron_type=kind, **one)
    activity = run(network, steps=100).activity
    assert activity.spikes.max() == 3
    assert activity.totals()["spikes"] == 250


def test_a_network_that_diverges_runs_as_in_nengo_and_its_spikes_have_counts() -> None:
    """Each spike once took memory of its own: the machine's was full after 33 steps."""
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(20, 1, neuron_type=nengo.SpikingRectifiedLinear())
        nengo.Connection(nengo.Node(1.0), a)
        nengo.Connection(a, a, function=np.square, transform=3)
        probe = nengo.Probe(a)
    ours = run(network)
    with nengo.Simulator(network, seed=7, optimize=False, progress_bar=False) as theirs:
        theirs.run_steps(STEPS)
    assert np.array_equal(ours.data[probe], theirs.data[probe])
    assert np.abs(ours.data[probe]).max() > 1e15
    spikes = ours.activity.spikes[:, 0]
    assert spikes[-1] == 1e7  # a million for each of 10 neurons
    assert ours.activity.synaptic_operations[-1, 0] == 20 * spikes[-2]


@pytest.mark.parametrize("kind", [nengo.RectifiedLinear(), nengo.Sigmoid(), nengo.LIFRate()])
def test_neurons_that_do_not_spike_have_no_spikes(kind: nengo.neurons.NeuronType) -> None:
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1, neuron_type=kind), nengo.Ensemble(5, 1)
        nengo.Connection(a, b)
    activity = run(network).activity
    assert activity.spikes[:, 0].sum() == 0
    assert activity.spikes[:, 1].sum() > 0
    assert activity.messages.sum() == 0
    assert activity.updates_active[0].tolist() == [20, 5]


def listed(twice: bool, pipeline: str) -> tuple[Activity, np.ndarray]:
    """Return the counts and values of a network whose ensemble and connection two networks list."""
    with nengo.Network(seed=1) as network:
        a, b = nengo.Ensemble(20, 1, label="a"), nengo.Ensemble(10, 1, label="b")
        wired = nengo.Connection(a, b)
        probe = nengo.Probe(b, synapse=0.01)
        if twice:
            with nengo.Network(label="other"):
                for one in (b, wired, probe):
                    nengo.Network.add(one)
    with spikeport.Simulator(network, backend="reference", pipeline=pipeline) as simulator:
        simulator.run_steps(STEPS)
        return simulator.activity, simulator.data[probe]


@pytest.mark.parametrize("pipeline", ["", "fuse"])
def test_an_object_that_two_networks_list_is_counted_once(pipeline: str) -> None:
    (activity, values), (wanted, same) = (listed(twice, pipeline) for twice in (True, False))
    assert activity.cores == wanted.cores
    for name in ("spikes", "synaptic_operations", "messages", "updates_active"):
        assert np.array_equal(getattr(activity, name), getattr(wanted, name)), name
    assert np.array_equal(values, same)
