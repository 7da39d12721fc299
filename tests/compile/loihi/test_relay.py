"""Decode neurons of its own kind for each connection."""

import contextlib
from pathlib import Path

import nengo
import numpy as np
import pytest
from nengo_loihi.block import LoihiBlock, Synapse
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset10DecodeNeurons

from spikeport.compile.ground.settings import add_params
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.relay import ENCODERS, relay_filter_s, relayed
from spikeport.compile.pipeline import compile_network
from spikeport.simulator import Simulator
from tests.helpers.chip_networks import integer_blocks
from tests.helpers.event_files import camera_network, process_of, random_events, write_events
from tests.helpers.small_networks import rewrite_of


@pytest.fixture
def built() -> tuple[Model, nengo.Connection, LoihiBlock]:
    with nengo.Network():
        a, b = nengo.Ensemble(2, 1), nengo.Ensemble(2, 1)
        connection = nengo.Connection(a, b)
    model, block = Model(), LoihiBlock(2)
    model.objs[b]["in"] = block
    return model, connection, block


def test_the_models_decode_neurons_are_restored_at_the_end_and_after_an_error(built) -> None:
    model, connection, _ = built
    usual = model.decode_neurons
    with relayed(model, connection, "onoff"):
        assert type(model.decode_neurons) is OnOffDecodeNeurons
    assert model.decode_neurons is usual
    with contextlib.suppress(ZeroDivisionError), relayed(model, connection, "preset10"):
        assert type(model.decode_neurons) is Preset10DecodeNeurons
        raise ZeroDivisionError
    assert model.decode_neurons is usual


def test_each_kind_of_decode_neurons_has_its_own_group_of_synapses(built) -> None:
    model, connection, block = built
    made = {}
    for path in ("onoff", "preset10", "onoff"):
        with relayed(model, connection, path):
            if ENCODERS not in block.named_synapses:
                block.add_synapse(Synapse(2), name=ENCODERS)
            made.setdefault(path, []).append(block.named_synapses[ENCODERS])
    first, again = made["onoff"]
    assert first is again
    assert made["preset10"] != [first]
    assert set(block.named_synapses) == {f"{ENCODERS} onoff", f"{ENCODERS} preset10"}


def test_the_group_of_synapses_of_other_connections_stays(built) -> None:
    model, connection, block = built
    synapse = Synapse(2)
    block.add_synapse(synapse, name=ENCODERS)
    with relayed(model, connection, "onoff"):
        assert ENCODERS not in block.named_synapses
    assert block.named_synapses == {ENCODERS: synapse}


@pytest.mark.parametrize(
    ("own", "target", "relay"),
    [
        (0.1, 0.005, 0.094),
        (0.008, 0.002, 0.005),
        (0.006, 0.005, 0.005),
        (0.002, 0.005, 0.002),
        (None, 0.005, 0.0),
    ],
)
def test_a_relay_and_its_target_delay_as_much_as_the_synapse(
    built, own: float | None, target: float, relay: float
) -> None:
    _, connection, _ = built
    connection.synapse = own
    assert relay_filter_s(connection, target, 0.001) == pytest.approx(relay)


@pytest.mark.parametrize(
    ("own", "target", "asked"),
    [(0.03, 0.1, 0.03), (0.03, 0.02, 0.02), (0.002, 0.1, 0.005)],
)
def test_the_targets_filter_is_no_slower_than_the_connections_own(
    built, own: float, target: float, asked: float
) -> None:
    model, connection, _ = built
    connection.synapse = own
    model.objs[connection]["decoded"] = relay = LoihiBlock(2)
    with relayed(model, connection, "onoff", target_s=target):
        assert model.decode_tau == asked
    assert model.decode_tau == 0.005
    assert relay.compartment.tau_s == relay_filter_s(connection, target, model.dt)
    failing = relayed(model, connection, "onoff", target_s=target)
    with contextlib.suppress(ZeroDivisionError), failing:
        raise ZeroDivisionError
    assert model.decode_tau == 0.005


def loop(gain: float, tau: float) -> nengo.Network:
    with nengo.Network(seed=0) as network:
        source = nengo.Node([0.5])
        a = nengo.Ensemble(200, 1)
        nengo.Connection(source, a)
        nengo.Connection(a, a, transform=gain, synapse=tau)
        nengo.Connection(a, a, transform=0.9, synapse=0.005)
    return network


def test_weights_too_small_for_every_exponent_are_made_larger() -> None:
    """In the loop of gain .2, decode neurons represent .25 of the radius, and weigh .25 as much."""
    floats = build(rewrite_of(loop(0.2, 0.1)), 0.001)
    ensemble, relay, other = floats.blocks
    _, few, usual = ensemble.synapses
    ratio = np.vstack(few.weights) / np.vstack(usual.weights)
    assert ratio == pytest.approx(np.full(ratio.shape, 0.25), rel=0.05)
    sizes = [np.vstack(block.synapses[0].weights) for block in (relay, other)]
    assert abs(sizes[0]).max() == pytest.approx(0.2 * 4 / 0.9 * abs(sizes[1]).max(), rel=0.1)


def test_a_group_of_synapses_without_input_is_removed() -> None:
    network = loop(0.2, 0.1)
    network.connections.pop()
    ensemble, _ = build(rewrite_of(network), 0.001).blocks
    assert len(ensemble.synapses) == 2
    assert len(ensemble.named_synapses) == 1
    assert integer_blocks(network).errors[1].lost_weights < 0.5


def test_weights_that_have_an_exponent_stay_in_their_group_of_synapses() -> None:
    ensemble, *_ = build(rewrite_of(loop(0.9, 0.05)), 0.001).blocks
    assert len(ensemble.synapses) == 2


def test_a_filter_that_all_connections_ask_for_changes_only_those_with_a_relay() -> None:
    def run(filter_s: float | None, relayed_too: bool) -> np.ndarray:
        with nengo.Network(seed=0) as network:
            add_params(network)
            ours = network.config[nengo.Connection]
            ours.decode_path, ours.target_filter_s = "preset10", filter_s
            a, b = nengo.Ensemble(50, 1), nengo.Ensemble(50, 1)
            nengo.Connection(nengo.Node([0.5]), a)
            nengo.Connection(a.neurons, b.neurons, transform=np.eye(50) / 1e3)
            nengo.Connection(a, b, solver=nengo.solvers.LstsqL2(weights=True))
            if relayed_too:
                nengo.Connection(a, b, synapse=0.05)
            probe = nengo.Probe(b.neurons)
        with Simulator(network, pipeline="", progress_bar=False) as sim:
            sim.run_steps(100)
            return sim.data[probe]

    np.testing.assert_array_equal(run(None, False), run(0.02, False))
    assert not np.array_equal(run(None, True), run(0.02, True))


def test_decode_neurons_of_event_files_keep_their_range_if_weights_are_tiny(tmp_path: Path) -> None:
    path = write_events(tmp_path / "camera.events", **random_events(200, last_us=50_000))
    network = camera_network(process_of(path))
    network.connections[-1].transform = np.full((1, 384), 1e-7)
    network.connections[-1].synapse = 0.1
    assert len(compile_network(network, pipeline="").image.synapses.weight)


def test_groups_of_synapses_that_are_set_aside_are_found_again() -> None:
    with nengo.Network(seed=0) as network:
        add_params(network)
        a, b, c, target = (nengo.Ensemble(n, 1) for n in (20, 500, 20, 60))
        nengo.Connection(a, target)
        weak = nengo.Connection(b, target, transform=0.01, synapse=0.1)
        nengo.Connection(c, target)
        network.config[weak].decode_path = "onoff"
    built = build(rewrite_of(network), 0.001)
    (block,) = (one for one in built.blocks if one.n_neurons == 60)
    # One group for the relays of a and c, and one for those of b, which are weaker.
    assert len(block.synapses) == 2
