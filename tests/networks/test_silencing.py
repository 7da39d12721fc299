import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.networks.policy import Layer, PolicyNetwork, PolicyOptions, policy, record_ranges
from spikeport.networks.silencing import silence

OBSERVATIONS = np.random.RandomState(1).uniform(-1, 1, (200, 4))
AT_S = 0.1


def small_policy() -> PolicyNetwork:
    rng = np.random.RandomState(0)
    layers = [
        Layer(rng.randn(n_out, n_in) / 2, rng.randn(n_out) / 5)
        for n_in, n_out in ((4, 6), (6, 6), (6, 3))
    ]
    return policy(layers, record_ranges(layers, OBSERVATIONS), PolicyOptions(n_neurons=8))


@pytest.mark.parametrize("backend", ["reference", "native"])
def test_the_drawn_ensembles_fall_silent_and_the_others_go_on(backend):
    net = small_policy()
    ensembles = list(net.all_ensembles)
    drawn = silence(net, 0.5, AT_S, synapse=0.002, seed=3)
    with nengo.Network(seed=0) as network:
        network.add(net)
        shown = nengo.Node(lambda t: np.sin(60 * t + np.arange(4)))
        nengo.Connection(shown, net.observation, synapse=None)
        nengo.Probe(net.action)
        probes = {e: nengo.Probe(e.neurons[:1]) for e in ensembles}
    with Simulator(network, backend=backend, pipeline="compact") as sim:
        sim.run(0.3)
    spikes = {e: sim.data[probe].ravel() != 0 for e, probe in probes.items()}
    before, after = slice(60, 100), slice(130, 300)
    active = [e for e in ensembles if spikes[e][before].any()]
    assert len(set(active) & set(drawn)) >= 5
    assert not any(spikes[e][after].any() for e in drawn)
    still = [e for e in active if spikes[e][after].any()]
    assert len(still) >= 0.8 * len(set(active) - set(drawn)) > 0


@pytest.mark.parametrize(("share", "n"), [(0.0, 0), (0.01, 1), (0.25, 6), (1.0, 24)])
def test_the_share_of_silenced_ensembles_is_drawn_from_the_seed(share, n):
    first, again, other = small_policy(), small_policy(), small_policy()
    labels = [
        [ensemble.label for ensemble in silence(net, share, AT_S, 0.002, seed)]
        for net, seed in ((first, 1), (again, 1), (other, 2))
    ]
    assert labels[0] == labels[1]
    assert len(labels[0]) == n
    assert (labels[0] != labels[2]) == (0 < share < 1)
