import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.networks.action_selection import action_selection
from spikeport.networks.gating import gate

OPEN, CLOSED = (0.8, 0.4), (0.4, 0.8)
HOLD_STEPS = 300


def squares(seed: int = 1) -> nengo.Network:
    """Return an ensemble that decodes the square of its input."""
    with nengo.Network(label="squares", seed=seed) as net:
        net.x = nengo.Node(size_in=1)
        net.ensemble = nengo.Ensemble(
            200,
            1,
            max_rates=nengo.dists.Uniform(200, 400),
            intercepts=nengo.dists.Uniform(-1, 0.8),
            neuron_type=nengo.LIF(initial_state={"voltage": nengo.dists.Choice([0])}),
        )
        net.y = nengo.Node(lambda _t, y: y, size_in=1)
        nengo.Connection(net.x, net.ensemble, synapse=None)
        nengo.Connection(net.ensemble, net.y, function=np.square, synapse=0.01)
    return net


def run(utilities: tuple[tuple[float, float], ...], x: float, gated: bool = True):
    """Return decoded values and spikes for one pair of utilities after the other."""
    with nengo.Network(seed=0) as network:
        net, selection = squares(), action_selection(2)
        shown = nengo.Node(lambda t: utilities[int((t - 5e-4) * 1000 / HOLD_STEPS)])
        nengo.Connection(shown, selection.utilities, synapse=None)
        nengo.Connection(nengo.Node([x]), net.x, synapse=None)
        if gated:
            gate(selection.nuclei["gate"][0], [net.ensemble])
        value, spikes = nengo.Probe(net.y), nengo.Probe(net.ensemble.neurons)
    with Simulator(network, pipeline="compact") as sim:
        sim.run_steps(HOLD_STEPS * len(utilities))
    return sim.data[value].ravel(), (sim.data[spikes] != 0).sum(axis=1)


def test_a_closed_gate_silences_all_neurons():
    """They fall silent within 30 ms of the utilities' change, until these change again."""
    value, spikes = run((OPEN, CLOSED, OPEN), x=0.9)
    opened, closed, reopened = spikes.reshape(3, HOLD_STEPS)
    assert opened[100:].min() > 0
    assert not closed[30:].any()
    assert np.abs(value[HOLD_STEPS + 150 : 2 * HOLD_STEPS]).max() < 1e-5  # the filter's tail
    assert reopened[60:].mean() == pytest.approx(opened[60:].mean(), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("x", [-0.8, 0.9])
def test_an_open_gate_changes_nothing(x):
    """Within 2 % of the range, which rounding the weights together with the gate's may cost."""
    gated, alone = (run((OPEN,), x, gated)[0][150:].mean() for gated in (True, False))
    assert gated == pytest.approx(alone, abs=0.02)


@pytest.mark.parametrize("action", [0, 1], ids=["closed", "open"])
def test_equal_weights_of_a_gate_make_inhibition_proportional_to_gains(action):
    """Nengo multiplies the input of neurons by their gains: in radii, it is the same for all."""
    with nengo.Network() as network:
        net, selection = squares(), action_selection(2)
        nengo.Connection(nengo.Node(CLOSED), selection.utilities, synapse=None)
        inhibitor = selection.nuclei["gate"][action]
        gate(inhibitor, [net.ensemble], strength=2.0)
        (connection,) = [c for c in network.connections if c.post_obj == net.ensemble.neurons]
        current, spikes = nengo.Probe(net.ensemble.neurons, "input"), nengo.Probe(inhibitor)
    with nengo.Simulator(network, progress_bar=False) as sim:
        sim.run(0.3)
        weights, ensemble = sim.data[connection].weights, sim.data[net.ensemble]
        inhibition = (ensemble.bias - sim.data[current][-100:].mean(axis=0)) / ensemble.gain
        rate_hz = sim.data[spikes][-100:].mean()
    assert rate_hz == pytest.approx([1650, 0][action], abs=150)
    assert inhibition == pytest.approx(np.full(200, 2.0 * rate_hz / 1000), rel=0.01, abs=0.01)
    assert weights.sum(axis=1) * 1000 == pytest.approx(np.full(200, -2.0))
    assert connection.pre_slice == slice(8 * action, 8 * action + 8)
