"""Images that are read from registers alone."""

from collections.abc import Callable

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.decompile import decompile
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.recording import Core
from spikeport.backends.board.nxsdk.written import Written, write
from spikeport.errors import BackendError, ImageError
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.writable import writable

SYNAPSES = [[64, -128, 192], [320, 0, 0]]


def written() -> Written:
    """Return registers of three compartments that one source on the host reaches."""
    block = Block(
        3,
        bias=[-7, 4000 * 8, 0],
        decay_u=[1, 2, 2],
        decay_v=9,
        vth=[64, 128, 64],
        refract_delay=3,
        noise_exp=3,
        noise_offset=-2,
        enable_noise=[1, 0, 1],
    )
    image = writable(Parts([block], [Group(SYNAPSES)], [1], [Route([1], input=0)]).image())
    return write(image, Placement.single(image))


def test_constants_are_read_back_from_registers() -> None:
    image = decompile(written(), 0.002)
    state, blocks = image.compartments, image.blocks
    assert state.bias.tolist() == [-7, 32000, 0]
    assert state.decay_u.tolist() == [1, 2, 2]
    assert state.decay_v.tolist() == [9, 9, 9]
    assert state.vth.tolist() == [64, 128, 64]
    assert state.refract_delay.tolist() == [3, 3, 3]
    assert state.enable_noise.tolist() == [1, 0, 1]
    assert (blocks.vmin.tolist(), blocks.vmax.tolist()) == ([1 - 2**23], [2**23 - 1])
    assert (blocks.noise_exp.tolist(), blocks.noise_offset.tolist()) == ([3], [-2])
    assert image.synapses.weight.reshape(2, 3).tolist() == SYNAPSES
    assert (image.out_axons.axon.tolist(), image.inputs.size.tolist()) == ([1], [1])
    assert image.manifest.dt_s == 0.002


CHANGES: list[tuple[Callable[[Core], None], str]] = [
    (lambda core: core.cxProfileCfg[0].configure(decayV=8), "compartments"),
    (lambda core: core.vthProfileCfg[0].staticCfg.configure(vth=77), "compartments"),
    (lambda core: core.dendriteSharedCfg.configure(negVmLimit=3), "blocks"),
    (lambda core: core.synapseFmt[1].configure(wgtExp=1), "synapses"),
    (lambda core: core.synapseMap[1].configure(synapsePtr=0), "in_axons"),
]


@pytest.mark.parametrize(("change", "table"), CHANGES)
def test_a_change_of_a_register_changes_the_image(
    change: Callable[[Core], None], table: str
) -> None:
    before = written()
    image = decompile(before, 0.001)
    change(before.board.cores[0])
    one, other = getattr(image, table), getattr(decompile(before, 0.001), table)
    assert any(not np.array_equal(getattr(one, c), getattr(other, c)) for c in one.columns())


def test_an_axon_that_leads_beyond_the_core_is_refused() -> None:
    registers = written()
    registers.board.cores[0].synapseMap[1].discreteMapEntry.configure(cxBase=1)
    with pytest.raises(ImageError, match=r"the farthest target of in_axons\[1\] is 3, at most 2"):
        decompile(registers, 0.001)


def test_compartments_that_are_not_updated_are_refused() -> None:
    registers = written()
    registers.board.cores[0].numUpdates.configure(numUpdates=0)
    with pytest.raises(BackendError, match="core 4 does not update all of its 3 compartments"):
        decompile(registers, 0.001)
