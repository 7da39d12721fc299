"""Random networks of all objects that network passes rewrite, and float runs of them."""

import nengo
import numpy as np
from nengo.builder import Model
from nengo_loihi.neurons import LoihiLIF, LoihiSpikingRectifiedLinear

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.passes.base import Context, NetworkPass
from spikeport.hardware_models import chip as chips

DT_S = 0.001
N_STEPS = 60
KINDS = (LoihiLIF(), LoihiSpikingRectifiedLinear(), LoihiLIF(tau_rc=0.03))
"""Neuron types whose decoders float Nengo solves for the chip's rates, as nengo-loihi does."""
TAUS = (0.002, 0.005)


def random_network(seed: int, learning: bool = False) -> nengo.Network:
    """Draw arrays, functions, slices, passthrough nodes, inhibition, filters, and probes."""
    rng = np.random.RandomState(seed)
    with nengo.Network(seed=seed, label="random") as network:
        network.config[nengo.Ensemble].intercepts = nengo.dists.Uniform(-1, 0.9)
        stimulus = nengo.Node(lambda t: np.sin(20 * t + np.arange(3)), label="stimulus")
        constant = nengo.Node(rng.uniform(-0.3, 0.3, 2), label="constant")
        output = nengo.Node(lambda _t, x: x, size_in=4, label="output")
        arrays = [_array(rng, n, d) for n, d in ((3, 1), (2, 2), (3, 1))]
        single = nengo.Ensemble(15, 2, radius=0.7, neuron_type=KINDS[0], label="single")
        _connect(rng, stimulus, arrays[0].input, function=np.square)
        _connect(rng, constant, arrays[1].input, synapse=None)
        for pre, post in ((0, 1), (1, 2), (2, 0), (2, 2)):
            _connect(rng, arrays[pre].output, arrays[post].input)
        squares = arrays[2].add_output("squares", np.square)
        _connect(rng, squares[1:], arrays[1].input[:2])
        _connect(rng, arrays[0].ensembles[1], single[1], function=lambda x: x - 0.1)
        nengo.Connection(constant[0], single[0], synapse=None)
        _connect(rng, single, arrays[0].ensembles[0], solver=nengo.solvers.LstsqL2(weights=True))
        _connect(rng, single, arrays[2].ensembles[2].neurons[3:8], function=np.prod, size=0.01)
        _connect(rng, single.neurons[2:9], arrays[1].ensembles[0], size=1e-3)
        _connect(rng, arrays[1].output, output)
        _connect(rng, single, output[1:3])
        probed = [arrays[1].output, arrays[2].ensembles[1], single[0], output]
        for obj in probed:
            nengo.Probe(obj, synapse=0.01)
        nengo.Probe(single.neurons[2:5])
        nengo.Probe(arrays[0].ensembles[2].neurons, "voltage")
        if learning:
            _learn(stimulus)
    return network


def _array(rng: np.random.RandomState, n: int, d: int) -> nengo.networks.EnsembleArray:
    return nengo.networks.EnsembleArray(
        12, n, d, radius=rng.uniform(0.5, 2), neuron_type=KINDS[rng.randint(len(KINDS))]
    )


def _connect(rng: np.random.RandomState, pre: object, post: object, **options: object) -> None:
    size = options.pop("size", 0.7)
    function = options.get("function")
    n = len(np.atleast_1d(function(np.zeros(pre.size_out)))) if function else pre.size_out
    options.setdefault("synapse", TAUS[rng.randint(len(TAUS))])
    transform = rng.uniform(-size, size, (post.size_in, n))
    nengo.Connection(pre, post, transform=transform, **options)


def _learn(stimulus: nengo.Node) -> None:
    pupil = nengo.Ensemble(20, 1, neuron_type=KINDS[0], label="pupil")
    error = nengo.Node(size_in=1, label="error")
    nengo.Connection(stimulus[0], pupil)
    learned = nengo.Connection(pupil, error, learning_rule_type=nengo.PES(1e-3))
    nengo.Connection(error, learned.learning_rule)
    nengo.Probe(error)


def rewritten(network: nengo.Network, *passes: NetworkPass) -> tuple[Rewrite, dict[str, object]]:
    """Return the network after some passes, and the notes of the last."""
    rewrite, notes = Rewrite(network, Names(network)), {}
    for one in passes:
        notes = {}
        rewrite = one.apply(rewrite, Context(chips.get("loihi"), DT_S, notes.__setitem__))
    return rewrite, notes


def float_run(rewrite: Rewrite, n_steps: int = N_STEPS) -> dict[nengo.Probe, np.ndarray]:
    """Return the values that a network's probes record in plain Nengo."""
    model = Model(dt=DT_S)
    model.seeds.update(rewrite.all_seeds())
    # To merge operators takes longer than all steps.
    plain = {"model": model, "progress_bar": False, "optimize": False}
    with nengo.Simulator(rewrite.network, **plain) as simulator:
        simulator.run_steps(n_steps, progress_bar=False)
        return {probe: simulator.data[probe] for probe in rewrite.network.all_probes}


def assert_equal_in_float(network: nengo.Network, *passes: NetworkPass) -> Rewrite:
    """Compare all probes of a network with its rewrite's probes, and return the rewrite."""
    before = float_run(Rewrite(network, Names(network)))
    rewrite, _ = rewritten(network, *passes)
    after = float_run(rewrite)
    for probe, wanted in before.items():
        assert np.abs(wanted).max() > 0
        found = after[rewrite.stand_ins.get(probe, probe)]
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    return rewrite
