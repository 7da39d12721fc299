"""Registers that nengo-loihi's builder writes for a placement, and its refusals."""

import pytest

from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.written import write
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.two_blocks import two_blocks
from tests.helpers.writable import writable


def test_registers_hold_the_synapses_of_the_image() -> None:
    image = writable(two_blocks())
    written = write(image, Placement.single(image))
    first, second = written.board.cores
    assert second.synapses.column("Wgt").tolist() == [1, 2, 3, 5]
    assert [(c.compartment, c.core_id, c.axon) for c in first.contacts] == [
        (0, second.id, 0),
        (1, second.id, 1),
    ]
    ((axon,),) = written.inputs[0].values()
    assert (axon["core_id"], axon["axon_id"]) == (second.id, 1)


def test_a_second_block_on_a_core_continues_the_numbers_of_compartments() -> None:
    image = writable(two_blocks())
    placement = Placement.packed(image.on_cores(0 * image.blocks.core))
    (core,) = write(image, placement).board.cores
    assert core.synapses.column("CIdx").tolist() == [2, 3, 4, 4]


def test_eight_thresholds_are_written() -> None:
    image = Parts([Block(1, vth=64 * (i + 1)) for i in range(8)]).image()
    (core,) = write(image, Placement.packed(image)).board.cores
    assert len(core.bank("vthProfileCfg")) == 8


def test_a_refusal_of_the_builder_is_quoted() -> None:
    group = Group([[64], [128]], axon_row=[0])  # no axon reads the second row
    image = writable(Parts([Block(1)], [group], [1], [Route([0], input=0)]).image())
    with pytest.raises(BackendError) as caught:
        write(image, Placement.single(image))
    assert str(caught.value) == (
        "nengo-loihi's hardware half refuses the image (build_synapse: Synapse pointer did not "
        "align with precomputed synapse length); cure: one block a core, compiled with -p unpacked "
        "or compact_unpacked"
    )
