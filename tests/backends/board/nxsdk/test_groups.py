"""Groups of synapses that are read from registers, and refusals of registers."""

import pytest

from spikeport.backends.board.nxsdk.groups import groups_of, value, values
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.backends.board.nxsdk.registers import Register
from spikeport.backends.board.nxsdk.written import write
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.writable import writable


def test_a_core_has_a_group_for_each_kind_of_axon() -> None:
    plain = Group([[64, 128]], axon_row=[0, 0])
    population = Group([[[64, 64], [128, 64]]], axon_base=[4], pop_type=16)
    routes = [Route([0, 1], group=0, input=0), Route([0, 0], atom=[0, 1], group=1, input=0)]
    image = writable(Parts([Block(8)], [plain, population], [2], routes).image())
    (core,) = write(image, Placement.single(image)).board.cores
    first, second = groups_of(0, core)
    assert (first.kind, [(a.number, a.base) for a in first.axons]) == (0, [(0, 0), (1, 0)])
    assert (second.kind, [(a.number, a.base) for a in second.axons]) == (16, [(2, 4)])
    assert first.rows == {(0, 2, 1): 0}
    assert second.rows == {(2, 2, 2): 0}


def test_a_row_of_two_formats_is_refused() -> None:
    core = Board(1, 1, [1], [[0]]).cores[0]
    for number in range(2):
        core.synapses[number].configure(CIdx=0, Wgt=1, synFmtId=number, LrnEn=0)
    core.synapseMap[3].configure(synapsePtr=0, synapseLen=2)
    core.synapseMap[3].discreteMapEntry.configure(cxBase=0)
    with pytest.raises(BackendError, match=r"axon 3 of core 7 has synapses of formats \[0 1\]"):
        groups_of(7, core)


def test_a_field_that_was_not_written_is_named() -> None:
    register = Register()
    register.configure(vth=5)
    assert value(register, "vth") == 5
    assert values([register, register], "vth").tolist() == [5, 5]
    with pytest.raises(BackendError, match="register field decayU was not written"):
        value(register, "decayU")
