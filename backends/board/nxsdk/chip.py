"""`NxsdkChip`: an image on a board of NxSDK, in a process of its own."""

import contextlib
import multiprocessing
import os
from collections.abc import Callable, Mapping
from contextlib import closing
from multiprocessing.connection import Connection

import numpy as np

from spikeport.backends.board.nxsdk.hardware import (
    HardwareModules,
    real_hardware,
    recording_hardware,
)
from spikeport.backends.board.nxsdk.traps import SPIKE_VOLTAGE
from spikeport.backends.board.nxsdk.voltage_register import refractory_left
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.step_log import StepLog
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError, SpikeportError
from spikeport.hardware_models.activity import Activity
from spikeport.interrupts import uninterruptible
from spikeport.progress import say_nothing

SPAWN = multiprocessing.get_context("spawn")
END_S = 10.0
"""The time the board's process has to end, before it is killed."""
BUILD_S = 900.0
"""The time that process has to build the board."""
STEP_S = 60.0
"""The time it has for a step: nengo-loihi's interface gives a board's host up after 10 s."""


def snips_hardware() -> HardwareModules:
    """Import the hardware half on recorded registers that step behind nengo-loihi's snips."""
    from spikeport.backends.board.nxsdk.live import Live
    from spikeport.backends.board.nxsdk.package import modules
    from spikeport.backends.board.nxsdk.recording import BANKS

    hardware = recording_hardware(modules(Live))
    hardware.allow_profiles(BANKS["cxProfileCfg"], BANKS["vthProfileCfg"])
    return hardware


class NxsdkChip:
    """An image on a board of NxSDK. Implements `spikeport.backends.board.board.CountingChip`.

    A second board in one process received the last messages of the first, so each board has a
    process of its own. A board counts nothing, so the native chip steps beside it and gives the
    counts. Values that differ between the two are counted, too.

    Parameters
    ----------
    image : ChipImage
        The image.
    seed : int
        Seed of the native chip, and of the numbers that nengo-loihi draws.
    hardware : callable
        Imports nengo-loihi's hardware half in that process: `real_hardware`, or `snips_hardware`.
    say : callable
        Is called at the end, with a line on the values that differed.

    Attributes
    ----------
    n_values : int
        Values read from the board.
    n_phantoms : int
        Spikes that the native chip does not have, and whose voltage looks like a spike.
    n_counting : int
        Voltages that differ because the chip counts the refractory time down in their register.
    n_differing : int
        Other values that differ from the native chip's.

    Raises
    ------
    MissingExtraError
        If NxSDK, or gcc for `snips_hardware`, is not installed.
    BackendError
        If nengo-loihi's hardware half refuses the image, or the process dies.
    """

    link: dict[str, object] | None = None

    def __init__(
        self,
        image: ChipImage,
        seed: int,
        hardware: Callable[[], HardwareModules] = real_hardware,
        say: Callable[[str], None] = say_nothing,
    ) -> None:
        self._twin, self._say = NativeChip(image, seed), say
        self._refract = image.compartments.refract_delay
        self._reads = [
            (output.key, image.read_by(number))
            for number, output in enumerate(image.manifest.outputs)
        ]
        self.n_values = self.n_phantoms = self.n_counting = self.n_differing = 0
        self._pipe, theirs = SPAWN.Pipe()
        self._process = SPAWN.Process(
            target=_serve, args=(theirs, image.to_bytes(), seed, hardware), daemon=True
        )
        # The server shuts the board down after Ctrl-C; its process must live to do so.
        with uninterruptible():
            self._process.start()
        theirs.close()
        try:
            self._answer(BUILD_S)
        except BaseException:  # an interrupt, too
            self._end()
            raise

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        with contextlib.suppress(OSError):  # `_answer` raises an error if the process died
            self._pipe.send((np.asarray(spikes), dict(errors)))
        expected = self._twin.step(spikes, errors)
        held = self._answer(STEP_S)
        state = self._twin.state
        left = refractory_left(state, self._refract)
        for native, read, (key, mine) in zip(expected, held, self._reads, strict=True):
            differs = native != read
            looks_fired = state.v[mine] == SPIKE_VOLTAGE * self._refract[mine]
            counts = (left[mine] > 0) & (read == SPIKE_VOLTAGE * left[mine])
            phantom = differs & looks_fired & (key == "spiked")
            counting = differs & counts & (key == "voltage")
            self.n_values += len(read)
            self.n_phantoms += int(phantom.sum())
            self.n_counting += int(counting.sum())
            self.n_differing += int((differs & ~phantom & ~counting).sum())
        return held

    def _answer(self, within_s: float) -> list[np.ndarray]:
        """Return the outputs' state, or raise the error that the board's process raised."""
        try:
            if not self._pipe.poll(within_s):
                self._end()  # a late answer would be taken for that of the next step
                raise BackendError(f"the board's process does not answer within {within_s:g} s")
            answer = self._pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join(END_S)
            code = self._process.exitcode
            raise BackendError(f"the board's process ended with exit code {code}") from None
        if isinstance(answer, Exception):
            raise answer
        held: list[np.ndarray] = answer
        return held

    @property
    def log(self) -> StepLog:
        """The counts of the native chip's steps."""
        return self._twin.log

    def activity(self) -> Activity:
        """Return the native chip's counts."""
        return self._twin.activity()

    def close(self) -> None:
        """Shut the board down, end its process, and say how many values differed."""
        self._say(
            f"{self.n_values:,} values read; other than the native chip's: {self.n_phantoms:,} "
            f"phantom spikes, {self.n_counting:,} voltages of refractory neurons, "
            f"{self.n_differing:,} more"
        )
        self._end()

    def _end(self) -> None:
        with contextlib.suppress(OSError):  # the process is gone already
            self._pipe.send(None)
        self._process.join(END_S)
        self._process.kill()
        self._process.join()
        self._pipe.close()
        self._twin.close()


def _serve(
    pipe: Connection, content: bytes, seed: int, hardware: Callable[[], HardwareModules]
) -> None:
    """Run the process of a board: build the board, and step it until the other end is done."""
    os.dup2(2, 1)  # snips print to standard output, which belongs to the server
    try:
        from spikeport.backends.board.nxsdk.device import Device

        with closing(Device(ChipImage.from_bytes(content), hardware(), seed)) as device:
            pipe.send([])
            while (asked := pipe.recv()) is not None:
                pipe.send(device.step(*asked))
    except SpikeportError as error:
        pipe.send(error)
    except EOFError:
        pass  # the server is gone
    except Exception as error:  # NxSDK's own errors, whose types are not known
        pipe.send(BackendError(f"the board failed: {type(error).__name__}: {error}"))
