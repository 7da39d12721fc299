"""Hints on sums of weights that wrap around, against runs of the network and the emulator."""

import warnings

import nengo
import numpy as np

import spikeport
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.check.overflow import MOST, largest, overflow_hints
from spikeport.compile.pipeline import compile_network
from tests.helpers.images import Block, Group, Parts, Route


def inhibited(n: int, weight: float = -1.0) -> nengo.Network:
    """Return a network in which n neurons that spike at once inhibit others."""
    with nengo.Network(seed=1) as network:
        gate = nengo.Ensemble(n, 1, label="gate", gain=np.full(n, 2.0), bias=np.ones(n))
        a = nengo.Ensemble(20, 1, label="a", gain=np.ones(20), bias=np.full(20, 3.0))
        nengo.Connection(nengo.Node(1.0), gate)
        nengo.Connection(gate.neurons, a.neurons, transform=np.full((20, n), weight / n))
        network.p = nengo.Probe(a.neurons)
    return network


def hints(network: nengo.Network) -> list[str]:
    found = compile_network(network).report.hints
    return [str(hint) for hint in found if hint.id == "SP423"]


def rate(network: nengo.Network, backend: str = "native") -> float:
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run(0.3)
    return float(sim.data[network.p].mean())


def test_an_inhibition_that_becomes_an_excitation_gets_a_hint() -> None:
    network = inhibited(400)
    assert hints(network) == [
        "a: SP423 input beyond its register: up to 6,502,400, in 20 of 20 neurons, limit "
        "2,097,151; cure: connect fewer neurons, or lower the weights"
    ]
    assert rate(network) > 100 > 10 > rate(network, "reference")


def test_fewer_neurons_and_lower_weights_get_none() -> None:
    for network in (inhibited(100), inhibited(200, -0.1)):
        assert hints(network) == []
        assert rate(network) < 10


def test_nengo_loihis_emulator_warns_of_the_same_networks() -> None:
    for n, n_warnings in ((400, True), (100, False)):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            rate(inhibited(n), "nengo-loihi")
        assert any("Overflow in q0" in str(one.message) for one in found) == n_warnings


def test_an_input_wraps_around_from_the_limit_on() -> None:
    weights = [[MOST - 64, -MOST + 64], [32, -32], [32, -32]]
    group = Group(weights=weights, block=1)
    image = Parts(
        [Block(3, bias=1, vth=0), Block(2, core=1, vth=2**22)],
        [group],
        routes=[Route(axon=[0, 1, 2], block=0)],
    ).image()
    assert largest(image).tolist() == [0, 0, 0, MOST, MOST]
    assert [hint.used for hint in overflow_hints(image)] == ["up to 2,097,152, in 2 of 2 neurons"]
    chip = NativeChip(image, 0)
    for _ in range(2):
        chip.step(np.zeros(0, dtype=int), {})
    assert chip.state.q[3] == -MOST  # all spiked at once


def test_weights_of_both_signs_cancel() -> None:
    group = Group(weights=[[MOST // 2]] * 2 + [[-MOST // 2]] * 2, block=1)
    blocks = [Block(4), Block(1, core=1)]
    image = Parts(blocks, [group], routes=[Route(axon=[0, 1, 2, 3], block=0)]).image()
    assert largest(image)[4] == 0
    assert list(overflow_hints(image)) == []


def test_values_from_the_host_and_relays_are_left_out() -> None:
    with nengo.Network(seed=1) as network:
        a = nengo.Ensemble(50, 1)
        nengo.Connection(nengo.Node(1.0), a)
        b = nengo.Ensemble(50, 1)
        nengo.Connection(a, b)
    compilation = compile_network(network, pipeline="as_written")
    image = compilation.image
    of_b = [k for k, one in enumerate(image.manifest.blocks) if one.kind == "ensemble"]
    assert (largest(image)[np.isin(image.compartment_block, of_b)] == 0).all()
    assert largest(image).max() > 0  # neurons that a relay reads
