"""Registers that step like their image, alone and behind nengo-loihi's own snips."""

import shutil

import numpy as np
import pytest

from spikeport.backends.board.nxsdk.chip import snips_hardware
from spikeport.backends.board.nxsdk.device import Device
from spikeport.backends.board.nxsdk.live import Live, Registers
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.backends.board.nxsdk.traps import SPIKE_VOLTAGE
from spikeport.backends.board.nxsdk.written import write
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Output, Parts, Route
from tests.helpers.writable import writable

STEPS = 300
REFRACT = 3


def image() -> ChipImage:
    """Return an image of two inputs with a common axon, neurons that spike, and read-outs.

    The voltage of the last neuron grows by 64 a step, and so looks like a spike once on its way.
    """
    rng = np.random.RandomState(2)
    groups = [
        Group(64 * rng.randint(-40, 60, size=(6, 3))),
        Group(64 * rng.randint(-20, 20, size=(3, 40)), block=1),
    ]
    return writable(
        Parts(
            blocks=[
                Block(
                    4,
                    bias=[40, 900, 300, 64],
                    vth=6400,
                    decay_v=[99, 99, 99, 0],
                    refract_delay=REFRACT,
                ),
                Block(40, core=1, decay_v=200, decay_u=400),
            ],
            groups=groups,
            inputs=[4, 3],
            routes=[
                Route([0, 1, 2, 3], input=0),
                Route([3, 4, 5], input=1),
                Route([0, 1, 2, -1], group=1, block=0),
            ],
            outputs=[
                Output("spiked", [0, 1, 2, 3]),
                Output("voltage", np.arange(4, 44)),
                Output("current", [43, 4, 8]),
            ],
        ).image()
    )


def trains() -> list[np.ndarray]:
    rng = np.random.RandomState(0)
    return [np.flatnonzero(rng.uniform(size=7) < 0.4) for _ in range(STEPS)]


def test_registers_step_like_the_image() -> None:
    written = write(image(), Placement.single(image()))
    registers, native = Registers(written), NativeChip(image(), 0)
    sources = [axons for axon_map in written.inputs for axons in axon_map.values()]
    for spikes in trains():
        native.step(spikes, {})
        u, v = registers.step()
        assert np.array_equal(u, native.state.u)
        spiked = native.state.spiked == 1
        assert (v[spiked] == REFRACT * SPIKE_VOLTAGE).all()
        resting = ~spiked & (native.state.refractory > 0)
        assert (v[resting] < REFRACT * SPIKE_VOLTAGE).all()
        assert np.array_equal(v[~spiked & ~resting], native.state.v[~spiked & ~resting])
        sent = [axon for source in spikes for axon in sources[source]]
        rows = [[axon["core_id"], axon["axon_id"], axon["atom"]] for axon in sent]
        registers.receive(np.array(rows, dtype=int).reshape(-1, 3))
    assert native.state.spike_count.sum() > 50


def test_registers_of_several_chips_are_refused() -> None:
    with pytest.raises(BackendError, match="2 chips; recorded registers step on 1"):
        Live(Board(1, 2, [1, 1], [[0], [0]]))


def test_registers_of_an_image_that_learns_are_refused() -> None:
    group = Group([[64, 64]], learning=(1, 1, -7, 10, 2.5, 2, 4))
    learns = writable(Parts([Block(2)], [group], [1], [Route([0], input=0)]).image())
    board = write(learns, Placement.single(learns)).board
    with pytest.raises(BackendError, match=r"the image learns: .*; cure: --machine native"):
        Live(board)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("g++") is None, reason="compiles nengo-loihi's snips with g++")
@pytest.mark.parametrize("core", [[0, 1], [0, 0]], ids=["one block a core", "packed"])
def test_snips_carry_spikes_and_state_both_ways(core: list[int]) -> None:
    placed = image().on_cores(np.array(core))
    native, device = NativeChip(placed, 0), Device(placed, snips_hardware(), 0)
    phantoms = 0
    for spikes in trains():
        fired, *others = native.step(spikes, {})
        read, *others_read = device.step(spikes, {})
        phantom = native.state.v[:4] == REFRACT * SPIKE_VOLTAGE
        phantoms += int(phantom.sum())
        assert np.array_equal(read, fired | phantom)
        assert all(map(np.array_equal, others_read, others))
    device.close()
    assert native.state.spike_count.sum() > 50
    assert phantoms >= STEPS * 64 // 6400
