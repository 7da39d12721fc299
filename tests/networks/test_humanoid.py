from collections.abc import Sequence

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.networks.arm import ArmSizes, arm
from spikeport.networks.humanoid import HumanoidNetwork, HumanoidOptions, humanoid, without_bias
from spikeport.networks.path_follower import path_follower
from spikeport.networks.path_following import FollowerGains
from spikeport.networks.policy import Layer, policy, record_ranges
from spikeport.networks.walking_policy import load

SMALL = ArmSizes(m1=60, cb=40, s1=10)
WALK, DRAW = (0.8, 0.4), (0.4, 0.8)
HOLD_STEPS = 300
CLOSED_STEPS = 35
"""Steps from new utilities until a closing gate has silenced its neurons."""
PARTS = ("arm", "follower", "policy")


def small_layers() -> list[Layer]:
    rng = np.random.RandomState(0)
    weights = [rng.randn(8, 6) / np.sqrt(6), rng.randn(4, 8) / np.sqrt(8)]
    return [Layer(w, rng.uniform(0.5, 1.0, len(w))) for w in weights]


def observed(layers: Sequence[Layer]) -> np.ndarray:
    return 0.3 * np.random.RandomState(1).randn(200, layers[0].weights.shape[1])


def parts(law, region, sizes, layers, options=None) -> HumanoidNetwork:
    return humanoid(
        arm(law, region, sizes),
        path_follower(FollowerGains()),
        policy([*layers[:-1], without_bias(layers[-1])], record_ranges(layers, observed(layers))),
        layers[-1].bias,
        options,
    )


def shown(net: HumanoidNetwork, law, region) -> nengo.Network:
    """Return the humanoid at one state of the robot, with utilities to walk, draw and walk."""
    q = region.q_samples[0]
    inputs = {
        net.arm.state: np.concatenate([q, np.zeros(4), law.arm.at(q).position]),
        net.arm.target: region.x.centre,
        net.follower.reference: np.array([0.5, 0.3, 0.5, 0.0]),
        net.policy.observation: np.full(net.policy.observation.size_in, 0.2),
    }
    phases = (WALK, DRAW, WALK)
    with nengo.Network(seed=0) as network:
        network.add(net)
        for node, value in inputs.items():
            nengo.Connection(nengo.Node(value), node, synapse=None)
        wanted = nengo.Node(lambda t: phases[int((t - 5e-4) * 1000 / HOLD_STEPS)])
        nengo.Connection(wanted, net.utilities, synapse=None)
        network.outputs = [nengo.Probe(node) for node in (net.torque, net.command, net.action)]
        ensembles = {
            "arm": [e for group in net.arm.groups.values() for e in group],
            "follower": net.follower.all_ensembles,
            "policy": net.policy.all_ensembles,
        }
        network.spikes = {part: [nengo.Probe(e.neurons) for e in ensembles[part]] for part in PARTS}
    return network


def run(
    network: nengo.Network, **where: str
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return (n_phases, steps, size) outputs and (n_phases, steps) spikes of each part."""
    with Simulator(network, **{"pipeline": "compact", **where}) as sim:
        sim.run_steps(3 * HOLD_STEPS)
        values = [sim.data[probe].reshape(3, HOLD_STEPS, -1) for probe in network.outputs]
        spikes = [
            sum((sim.data[probe] != 0).sum(axis=1) for probe in network.spikes[part])
            for part in PARTS
        ]
    return (
        dict(zip(PARTS, values, strict=True)),
        {part: n.reshape(3, HOLD_STEPS) for part, n in zip(PARTS, spikes, strict=True)},
    )


@pytest.fixture(scope="module")
def small_run(law, region):
    """Return the outputs and spikes of a small humanoid, see `run`."""
    return run(shown(parts(law, region, SMALL, small_layers()), law, region))


@pytest.mark.slow
def test_one_action_silences_the_other(small_run):
    outputs, spikes = small_run
    for part, closed in (("arm", (0, 2)), ("follower", (1,)), ("policy", (1,))):
        for phase in range(3):
            late = spikes[part][phase, CLOSED_STEPS:]
            value = outputs[part][phase, -50:].mean(axis=0)
            if phase in closed:
                assert not late.any()
                assert value == pytest.approx(0, abs=1e-3)  # the filters have nearly decayed
            else:
                assert late[100:].mean() > 1
                assert np.abs(value).max() > 0.1


@pytest.mark.slow
def test_nengo_spas_selection_silences_the_other_action_in_float(law, region):
    net = parts(law, region, SMALL, small_layers(), HumanoidOptions(spa=True))
    _, spikes = run(shown(net, law, region), backend="reference", pipeline="")
    for part, is_open in (("arm", 1), ("follower", 0), ("policy", 0)):
        late = spikes[part][:, 2 * CLOSED_STEPS :].sum(axis=1)
        assert [bool(n) for n in late] == [phase % 2 == is_open for phase in range(3)]


@pytest.mark.slow
def test_an_open_policy_does_what_it_does_alone(small_run):
    """Within 0.02: its bias comes from neurons, and its weights share their steps with the gate."""
    layers = small_layers()
    outputs, _ = small_run
    with nengo.Network(seed=0) as network:
        alone = policy(layers, record_ranges(layers, observed(layers)))
        nengo.Connection(nengo.Node(np.full(6, 0.2)), alone.observation, synapse=None)
        action = nengo.Probe(alone.action)
    with Simulator(network, pipeline="compact") as sim:
        sim.run_steps(HOLD_STEPS)
        expected = sim.data[action][-100:].mean(axis=0)
    assert outputs["policy"][0, -100:].mean(axis=0) == pytest.approx(expected, abs=0.02)


@pytest.mark.slow
def test_a_policy_that_balances_is_never_silent(law, region):
    options = HumanoidOptions(balances=True)
    outputs, spikes = run(shown(parts(law, region, SMALL, small_layers(), options), law, region))
    assert not spikes["follower"][1, CLOSED_STEPS:].any()
    assert all(phase[CLOSED_STEPS:].any() for phase in spikes["policy"])
    walking, drawing, _ = outputs["policy"][:, -100:].mean(axis=1)
    assert np.abs(walking).max() > 0.1
    assert drawing == pytest.approx(walking, abs=0.05)


@pytest.mark.slow
def test_the_humanoid_at_full_size_fits_on_26_cores(law, region):
    """It took 24 when this was written."""
    network = shown(parts(law, region, None, load().layers), law, region)
    with Simulator(network, pipeline="compact") as sim:
        assert len(sim.compilation.report.cores) <= 26
