"""Registers of a core: their fields, bounds and order."""

import pytest

from spikeport.backends.board.nxsdk.registers import Bank, Register, SynapseMemory
from spikeport.errors import BackendError


def test_fields_are_written_in_two_ways_and_nest() -> None:
    register = Register()
    register.configure(decayU=3, decayV=4)
    register.wgtExp = 2
    register.staticCfg.configure(vth=7)
    assert (register.decayU, register.decayV, register.wgtExp) == (3, 4, 2)
    assert register.staticCfg.vth == 7
    assert isinstance(register.never, Register)


def test_a_register_beyond_the_core_is_refused() -> None:
    bank = Bank("vthProfileCfg", 8)
    assert bank[7] is bank[7]
    with pytest.raises(BackendError, match=r"^register vthProfileCfg\[8\]; a core has 8$"):
        bank[8]


def test_synapses_are_kept_as_columns_in_order() -> None:
    memory = SynapseMemory()
    memory[0].configure(CIdx=5, Wgt=-3, synFmtId=1, LrnEn=0)
    memory[1].configure(CIdx=6, Wgt=4, synFmtId=1, LrnEn=1)
    assert memory.column("Wgt").tolist() == [-3, 4]
    assert memory.column("LrnEn").tolist() == [0, 1]
    with pytest.raises(BackendError, match="synapse 3 of a core is written after 2 others"):
        memory[3].configure(CIdx=0, Wgt=0, synFmtId=0, LrnEn=0)
