"""An image, written through nengo-loihi's hardware half into registers."""

import traceback
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from nengo_loihi.hardware.validate import validate_board

from spikeport.backends.board.nxsdk import recording
from spikeport.backends.board.nxsdk.allocator import Allocator, n_chips
from spikeport.backends.board.nxsdk.hardware import HardwareModules, recording_hardware
from spikeport.backends.board.nxsdk.model import Placement, model_of
from spikeport.backends.board.nxsdk.package import modules
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError

REFUSALS = (AssertionError, NotImplementedError, TypeError, ValueError)
"""The errors that nengo-loihi's builder raises for an image that it cannot write."""


AxonMap = Mapping[int, Sequence[np.ndarray]]
"""The axons that each source of an input reaches, as nengo-loihi's ``LoihiSpikeInput`` has them."""


class Written(NamedTuple):
    """The registers of a board, and the axons that each source of the host's inputs reaches."""

    board: recording.Board
    inputs: Sequence[AxonMap]


def write(
    image: ChipImage, placement: Placement, hardware: HardwareModules | None = None
) -> Written:
    """Write an image into recorded registers.

    Parameters
    ----------
    image : ChipImage
        The image.
    placement : Placement
        The core of each block.
    hardware : HardwareModules, optional
        nengo-loihi's hardware half on a recording NxSDK; by default a new import.

    Raises
    ------
    BackendError
        If nengo-loihi's builder refuses the image; the message has its words.
    """
    hardware = recording_hardware(modules(None)) if hardware is None else hardware
    hardware.allow_profiles(recording.BANKS["cxProfileCfg"], recording.BANKS["vthProfileCfg"])
    model = model_of(image, placement)._replace(probes=[])
    try:
        allocated = Allocator(placement)(model, n_chips(placement))
        validate_board(allocated)
        board = hardware.builder.build_board(allocated, use_snips=True, seed=0)
    except REFUSALS as error:
        raise refusal(error) from None
    return Written(board, [board.spike_inputs[source].axon_map for source in model.inputs])


def refusal(error: Exception) -> BackendError:
    """Return the error of a refusal by nengo-loihi's hardware half: its words or its assertion."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    words = str(error) or (last.line or type(error).__name__)
    return BackendError(
        f"nengo-loihi's hardware half refuses the image ({last.name}: {words}); "
        "cure: one block a core, compiled with -p unpacked or compact_unpacked"
    )
