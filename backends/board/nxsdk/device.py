"""A board on nengo-loihi's hardware interface: it takes spikes and errors, and returns state."""

from collections.abc import Mapping

import numpy as np

from spikeport.backends.board.nxsdk.allocator import Allocator, n_chips
from spikeport.backends.board.nxsdk.answer import recv_bytes
from spikeport.backends.board.nxsdk.findings import axons_by_source, findings
from spikeport.backends.board.nxsdk.hardware import HardwareModules
from spikeport.backends.board.nxsdk.model import Placement, model_of
from spikeport.backends.board.nxsdk.written import REFUSALS, refusal
from spikeport.backends.nengo_loihi import by_input
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError

RETRIES = 1_000
"""Number of waits of 10 ms for an answer; nengo-loihi's 10 are too few on a busy host."""
ENDLESS = 2**30
"""Steps that a board is asked to run: it runs until it is shut down."""


class Device:
    """An image on a board.

    Parameters
    ----------
    image : ChipImage
        The image; its own placement is used.
    hardware : HardwareModules
        nengo-loihi's hardware half, on a real NxSDK or a recording one.
    seed : int
        Seed of the numbers that nengo-loihi draws: for rounding traces, not for noise.

    Raises
    ------
    BackendError
        If nengo-loihi's hardware half refuses the image.
    """

    def __init__(self, image: ChipImage, hardware: HardwareModules, seed: int) -> None:
        placement = Placement.packed(image)
        for found in findings(image, placement):
            if found.trap.refused:
                raise BackendError(str(found))
        self._image, self._at = image, 0
        self._axons = axons_by_source(image)
        self._most = max(int(self._axons.sum()), 1)
        self._model = model_of(image, placement)
        # The chip waits for errors of each group that learns in each step.
        self._no_errors = {group: np.zeros(size) for group, size in image.error_sizes.items()}
        hardware.interface.HostSnip.recv_retries = RETRIES
        hardware.interface.HostSnip.recv_bytes = recv_bytes
        try:
            self._interface = hardware.interface.HardwareInterface(
                self._model,
                use_snips=True,
                seed=seed,
                snip_max_spikes_per_step=self._most,
                n_chips=n_chips(placement),
                allocator=Allocator(placement),
            )
        except REFUSALS as error:
            raise refusal(error) from None
        try:
            self._interface.connect()
            self._interface.run_steps(ENDLESS, blocking=False)
        except BaseException:  # an interrupt, too: a board that is connected stays on
            self.close()
            raise

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`.

        Raises
        ------
        BackendError
            If sources spike more than once, and the board would drop some of their spikes.
        """
        self._at += 1
        if (n := int(self._axons[spikes].sum())) > self._most:
            raise BackendError(
                f"step {self._at}: sources that spike more than once send {n:,} spikes, limit "
                f"{self._most:,}, one for each axon; cure: --machine native, or one event for a "
                "source in a step"
            )
        sent, sent_errors = by_input(self._image, spikes), {**self._no_errors, **errors}
        self._interface.host2chip(
            [(source, self._at, s) for source, s in zip(self._model.inputs, sent, strict=True)],
            [(self._model.synapses[g], self._at, error) for g, error in sent_errors.items()],
        )
        # No signals of Nengo: the values are taken as the snips read them.
        self._interface.chip2host({})
        held = self._interface.snips.probe_data
        return [np.ravel(held[probe].pop()).astype(np.int32) for probe in self._model.probes]

    def close(self) -> None:
        """Shut the board down."""
        try:
            self._interface.close()
        except OSError:  # the board's host is gone, and its socket is what closes first
            if (board := self._interface.nxsdk_board) is not None:
                board.disconnect()
