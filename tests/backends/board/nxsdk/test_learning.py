"""The comparison of the registers of learning with an image."""

from collections.abc import Callable

import pytest

from spikeport.backends.board.nxsdk.learning import learning_differs
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.recording import Core
from spikeport.backends.board.nxsdk.written import write
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.writable import writable

LEARNED = (1, 1, -7, 10, 2.5, 2, 4)


def image(learning: tuple[float, ...] = LEARNED) -> ChipImage:
    group = Group([[64, 64], [128, 64]], learning=learning)
    return writable(Parts([Block(2)], [group], [2], [Route([0, 1], input=0)]).image())


def differing(change: Callable[[Core], object], expected: ChipImage | None = None) -> list[str]:
    """Return the registers that differ from an image after a change."""
    placement = Placement.single(image())
    written = write(image(), placement)
    change(written.board.cores[0])
    return learning_differs(expected or image(), placement, written)


def test_registers_as_written_do_not_differ() -> None:
    assert differing(lambda core: None) == []
    plain = image((0,) * 7)
    placement = Placement.single(plain)
    assert learning_differs(plain, placement, write(plain, placement)) == []


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda core: core.stdpPreCfg[0].configure(tau=3), "stdpPreCfg.tau"),
        (lambda core: core.stdpPreCfg[0].configure(spikeLevelInt=3), "stdpPreCfg.spikeLevel"),
        (lambda core: core.stdpUcodeMem[1].configure(word="dw = x1"), "stdpUcodeMem"),
        (lambda core: core.bank("synapseMap").pop(3), "synapseMap.singleTraceEntry"),
        (lambda core: core.numUpdates.configure(numStdp=1), "numUpdates.numStdp"),
    ],
)
def test_a_register_that_differs_is_named(change: Callable[[Core], object], name: str) -> None:
    assert differing(change) == [f"core 0: {name}"]


def test_registers_differ_from_an_image_that_learns_differently() -> None:
    assert differing(lambda core: None, image((0,) * 7)) == ["core 0: LrnEn"]
    assert differing(lambda core: None, image((1, 1, -6, 10, 2.5, 2, 4))) == [
        "core 0: learning rate"
    ]
