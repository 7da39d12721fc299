"""Recorded registers that step, behind nengo-loihi's own snips.

The registers are decompiled to an image, which native kernels step. nengo-loihi renders the snips
of the host and the chip, and gcc compiles them against spikeport's headers. So a step goes from
Python over TCP to the host's snip, over a channel to the chip's snip, into registers, and back.
"""

import threading
import time

import numpy as np

from spikeport.arrays import pointer
from spikeport.backends.board.nxsdk.compiled import compiled
from spikeport.backends.board.nxsdk.decompile import decompile
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.backends.board.nxsdk.traps import SPIKE_VOLTAGE
from spikeport.backends.board.nxsdk.voltage_register import refractory_left
from spikeport.backends.board.nxsdk.written import Written
from spikeport.backends.native.kernel import accept, deliver, update
from spikeport.backends.native.loaded import Loaded, neurons_of, resting_state
from spikeport.backends.native.noise import NONE as NO_NOISE
from spikeport.backends.native.wiring import wire
from spikeport.errors import BackendError
from spikeport.hardware_models.activity import PER_STEP

LISTENS_S = 10.0
"""The time in which the host's snip must begin to listen."""
ENDS_S = 5.0


class Registers:
    """The state of recorded registers, stepped by native kernels.

    Parameters
    ----------
    written : Written
        The registers. Each axon that the host can reach becomes one source of spikes.
    """

    def __init__(self, written: Written) -> None:
        axons = [axon for axon_map in written.inputs for all_ in axon_map.values() for axon in all_]
        # Each axon of the host is a source of its own; the length of a step has no effect here.
        self.image = decompile(Written(written.board, [{i: [a] for i, a in enumerate(axons)}]), 1.0)
        self._sources: dict[tuple[int, int, int], int] = {
            (int(axon["core_id"]), int(axon["axon_id"]), int(axon["atom"])): number
            for number, axon in enumerate(axons)
        }
        wiring = wire(self.image)
        self.state = resting_state(self.image, wiring)
        self._loaded = Loaded(wiring, neurons_of(self.image), self.state)
        self._counts = np.zeros((len(PER_STEP), self.image.n_cores), dtype=np.int64)
        self._n_arriving = 0

    def step(self) -> tuple[np.ndarray, np.ndarray]:
        """Advance by one step, and return the registers U and V of all compartments."""
        deliver(self._loaded, self._n_arriving, self._counts)
        self._n_arriving = update(self._loaded, 0, NO_NOISE, self._counts)
        state = self.state
        left = refractory_left(state, self.image.compartments.refract_delay)
        return state.u.copy(), np.where(left > 0, left * SPIKE_VOLTAGE, state.v).astype(np.int32)

    def receive(self, spikes: np.ndarray) -> None:
        """Take the host's spikes, rows of core, axon and atom, which arrive in the next step."""
        sources = [self._sources[core, axon, atom] for core, axon, atom in spikes.tolist()]
        n = accept(self._loaded, np.array(sources, dtype=np.int64))
        begin = self._n_arriving
        self.state.arriving[begin : begin + n] = self.state.pending[:n]
        self._n_arriving += n


class Live:
    """A recording board that steps; see `spikeport.backends.board.nxsdk.recording.Board`.

    Parameters
    ----------
    board : Board
        A board that was written to, with its snips.

    Raises
    ------
    MissingExtraError
        If there is no gcc.
    BackendError
        If the board has several chips, its image learns, or the host's snip cannot listen.
    """

    def __init__(self, board: Board) -> None:
        if len(board.n2Chips) > 1:
            raise BackendError(f"{len(board.n2Chips)} chips; recorded registers step on 1")
        if any(core.synapses.column("LrnEn").any() for core in board.cores):
            raise BackendError(
                "the image learns: what microcode NxSDK makes of a rule is not known, so recorded "
                "registers do not learn; cure: --machine native"
            )
        axon_maps = [source.axon_map for source in board.spike_inputs.values()]
        self._registers = Registers(Written(board, axon_maps))
        cores = [core for core in board.cores if core.compartments]
        sizes = np.diff(self._registers.image.blocks.start)
        self._core = np.repeat([core.id for core in cores], sizes).astype(np.int32)
        self._compartment = np.concatenate([np.arange(n) for n in sizes]).astype(np.int32)
        self._library = compiled(board)
        host = threading.Thread(target=self._library.board_host, daemon=True)
        self._threads = [host, threading.Thread(target=self._run, daemon=True)]
        for thread in self._threads:
            thread.start()
        self._await_host()

    def _await_host(self) -> None:
        deadline = time.monotonic() + LISTENS_S
        while not self._library.board_listens() and time.monotonic() < deadline:
            time.sleep(0.001)
        if self._library.board_listens() != 1:
            raise BackendError("nengo-loihi's host snip cannot listen on the port that it drew")

    def _run(self) -> None:
        """Step until the host shuts the snips down."""
        n, room = len(self._core), self._registers.image.n_inputs
        sent = np.zeros((max(room, 1), 3), dtype=np.int32)
        for number in range(1, 2**31 - 1):
            u, v = self._registers.step()
            held = [pointer(array) for array in (self._core, self._compartment, u, v, sent)]
            found = self._library.board_manage(number, n, *held, room)
            if found < 0:
                return
            self._registers.receive(sent[:found])

    def close(self) -> None:
        """Wait for the snips, which the host has shut down."""
        for thread in self._threads:
            thread.join(ENDS_S)
