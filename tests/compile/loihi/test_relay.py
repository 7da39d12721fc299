"""Decode neurons of one kind for each connection."""

import contextlib

import nengo
import pytest
from nengo_loihi.block import LoihiBlock, Synapse
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset10DecodeNeurons

from spikeport.compile.loihi.relay import ENCODERS, relayed


@pytest.fixture
def built() -> tuple[Model, nengo.Connection, LoihiBlock]:
    with nengo.Network():
        a, b = nengo.Ensemble(2, 1), nengo.Ensemble(2, 1)
        connection = nengo.Connection(a, b)
    model, block = Model(), LoihiBlock(2)
    model.objs[b]["in"] = block
    return model, connection, block


def test_the_kind_is_back_at_the_end_and_after_an_error(built) -> None:
    model, connection, _ = built
    usual = model.decode_neurons
    with relayed(model, connection, "onoff"):
        assert type(model.decode_neurons) is OnOffDecodeNeurons
    assert model.decode_neurons is usual
    with contextlib.suppress(ZeroDivisionError), relayed(model, connection, "preset10"):
        assert type(model.decode_neurons) is Preset10DecodeNeurons
        raise ZeroDivisionError
    assert model.decode_neurons is usual


def test_each_kind_has_a_group_of_synapses_of_its_own(built) -> None:
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


def test_the_groups_of_other_connections_stay(built) -> None:
    model, connection, block = built
    synapse = Synapse(2)
    block.add_synapse(synapse, name=ENCODERS)
    with relayed(model, connection, "onoff"):
        assert ENCODERS not in block.named_synapses
    assert block.named_synapses == {ENCODERS: synapse}
