"""`IntegrateAndFire` neurons on the chip: the integers they become, and their spikes."""

import nengo
import numpy as np
import pytest

import spikeport
from spikeport.compile.ground.refusal import RefusedError
from spikeport.neurons import IntegrateAndFire
from tests.helpers.chip_networks import integer_blocks

DT_S = 1e-3


def network(kind: IntegrateAndFire, weights: np.ndarray, n_sources: int = 2) -> nengo.Network:
    """Return neurons with weights from ``n_sources`` neurons, each spiking now and then."""
    with nengo.Network(seed=0) as net:
        leaks = 8 * np.arange(900, 900 + 200 * n_sources, 200)
        sources = _neurons(n_sources, IntegrateAndFire(2.0**15, leak=leaks), "sources")
        net.own = _neurons(len(weights), kind, "own")
        nengo.Connection(
            sources.neurons, net.own.neurons, transform=weights, synapse=nengo.Lowpass(0)
        )
        net.spikes = nengo.Probe(net.own.neurons)
        net.voltage = nengo.Probe(net.own.neurons, "voltage")
    return net


def _neurons(n: int, kind: IntegrateAndFire, label: str) -> nengo.Ensemble:
    return nengo.Ensemble(n, 1, gain=np.ones(n), bias=np.zeros(n), neuron_type=kind, label=label)


def own_block(net: nengo.Network):
    blocks = integer_blocks(net)
    return blocks.blocks[blocks.floats.labels.index("own")]


def test_integer_weights_and_thresholds_reach_the_chip_unchanged():
    weights = np.array([[64.0, -8128], [4096, 640]])
    kind = IntegrateAndFire(np.array([2.0**15, 2.0**16]), 0.25, np.array([0.0, 0.125]), leak=100)
    block = own_block(network(kind, weights))
    (synapse,) = block.synapses
    assert np.array([w[0] for w in synapse.weights]).T.tolist() == weights.tolist()
    assert synapse.synapse_cfg.weight_exp == -1
    assert block.compartment.vth.tolist() == [2**15, 2**16]
    assert block.compartment.decay_u.tolist() == [1023, 1023]  # the chip adds 1
    assert block.compartment.decay_v.tolist() == [0, 512]
    assert block.compartment.bias.tolist() == [100, 100]
    assert (block.compartment.vmin, block.compartment.vmax) == (1 - 2**23, 2**23 - 1)


def test_a_correction_changes_the_bias_on_the_chip_but_not_the_float_network():
    nets = [network(IntegrateAndFire(correction=c), np.full((1, 2), 640.0)) for c in (0, 50)]
    assert [own_block(net).compartment.bias.tolist() for net in nets] == [[0], [50]]
    voltages = []
    for net in nets:
        with spikeport.Simulator(net, backend="reference") as sim:
            sim.run_steps(20)
            voltages.append(np.array(sim.data[net.voltage]))
    assert voltages[0].any()
    np.testing.assert_array_equal(*voltages)


def test_large_weights_have_a_larger_step():
    block = own_block(network(IntegrateAndFire(), np.array([[2.0**20, 3000.0]])))
    (synapse,) = block.synapses
    step = 2 ** (7 + synapse.synapse_cfg.weight_exp)
    assert step == 2**14  # the least step of which 127 reach 2**20
    assert [int(w[0, 0]) for w in synapse.weights] == [2**20, 0]


@pytest.mark.parametrize(
    ("kind", "weight", "message"),
    [
        (IntegrateAndFire(), 3e6, "own: a weight of 3,000,000 units, at most 2,080,768; cure: "),
        (IntegrateAndFire(2.0**24), 64, "own: a threshold of 16,777,216 units, at most 8,388,544"),
        (IntegrateAndFire(leak=-6e5), 64, "own: a leak of 600,000 units, at most 524,160; cure: "),
    ],
)
def test_numbers_that_a_chip_cannot_hold_are_refused(kind, weight, message):
    with pytest.raises(RefusedError) as caught:
        spikeport.compile_network(network(kind, np.array([[weight, 0.0]])))
    assert str(caught.value).startswith(message)
    assert "own" in caught.value.about  # the ensemble, which --offload can move


def test_the_native_chip_equals_nengo_loihis_emulator_bit_for_bit():
    rng = np.random.default_rng(0)
    kind = IntegrateAndFire(2.0**15, rng.uniform(0.2, 1, 20), rng.uniform(0, 0.3, 20), leak=300)
    net = network(kind, rng.normal(2**12, 2**13, (20, 4)), n_sources=4)
    found = {}
    for backend in ("native", "nengo-loihi"):
        with spikeport.Simulator(net, backend=backend) as sim:
            sim.run_steps(100)
            found[backend] = [np.array(sim.data[p]) for p in (net.spikes, net.voltage)]
    assert found["native"][0].sum() * DT_S > 100
    assert found["native"][1].min() < -(2**13)  # voltages are not clipped at zero
    for one, other in zip(*found.values(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_float_network_spikes_nearly_as_often_as_the_chip():
    rng = np.random.default_rng(1)
    kind = IntegrateAndFire(2.0**16, 0.5, 0.1)
    net = network(kind, rng.normal(2**14, 2**13, (20, 4)), n_sources=4)
    found = {}
    for backend in ("native", "reference"):
        with spikeport.Simulator(net, backend=backend) as sim:
            sim.run_steps(100)
            found[backend] = np.array(sim.data[net.spikes])
    counts = [spikes.sum() * DT_S for spikes in found.values()]
    assert min(counts) > 100
    assert counts[0] == pytest.approx(counts[1], rel=0.02)


def test_every_block_of_an_ensemble_on_several_cores_is_rounded():
    net = network(IntegrateAndFire(2.0**15), np.full((1500, 2), 1000.0 * 64))
    image = spikeport.compile_network(net).image
    mine = [i for i, block in enumerate(image.manifest.blocks) if block.owner == "own"]
    assert len(mine) == 2
    assert set(image.blocks.vmin[mine]) == {1 - 2**23}
    assert image.synapses.weight.max() == 64000  # 125 steps of 512


def test_a_subclass_is_still_refused():
    class Own(IntegrateAndFire):
        pass

    with pytest.raises(RefusedError, match="SP002 neuron type: Own"):
        spikeport.compile_network(network(Own(), np.array([[64.0, 64]])))


def test_the_loss_to_rounding_can_be_measured():
    from spikeport.backends.loss import measure

    # A decay of 0.0123 is 50/4096 on the chip, and costs a spike now and then.
    net = network(IntegrateAndFire(2.0**15, 0.5, 0.0123), np.full((5, 2), 7000.0))
    loss = measure(net, spikeport.compile_network(net), 0.1, 0, lambda *_: None).loss
    assert 0 < loss.output_error < 0.2
