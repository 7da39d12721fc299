"""Images on soft cores, in Verilator or on a board, with the native chip beside them."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack

import numpy as np

from spikeport.backends.chip import CLOSED
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore import port
from spikeport.backends.softcore.line import ByteLine
from spikeport.backends.softcore.memory import MemoryImage
from spikeport.backends.softcore.port import Held, Output
from spikeport.backends.softcore.simulation import STATE, Simulation
from spikeport.backends.softcore.verilated import Build
from spikeport.backends.softcore.writer import soft_chip_of, written
from spikeport.backends.step_log import LogOptions, StepLog
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.timing import timing
from spikeport.progress import say_nothing

HELD = {"current": Held.U, "voltage": Held.V, "spiked": Held.SPIKE}
"""The register of each kind of output."""
PLACES = {Held.U: 0, Held.V: 1, Held.SPIKE: 2}
"""The places of registers in the return value of `Simulation.read`."""


class SoftChip(ABC):
    """An image on soft cores. Implements `spikeport.backends.board.board.CountingChip`.

    The native chip steps beside it and gives the counts. After every step, the values that can be
    read from the soft cores are compared with the native chip's.

    Parameters
    ----------
    image : ChipImage
        The image.
    seed : int
        A seed without effect: images that draw random numbers are refused.
    memory : MemoryImage
        The image as the cores hold it.
    say : callable
        Is called with a line at the first step that differs, and at the end with a line on the
        values that differed, and one on cycles.

    Attributes
    ----------
    differing : Counter of str
        Values that differed, by their names in `compared`.
    n_steps, total_cycles, worst_cycles : int
        Steps, and their cycles: the sum, and the longest step.
    """

    link: dict[str, object] | None = None

    compared: dict[str, int]
    """Number of values of each name that are compared in a step."""

    def __init__(
        self, image: ChipImage, seed: int, memory: MemoryImage, say: Callable[[str], None]
    ) -> None:
        self._memory, self._say = memory, say
        # Cycles are compared with those of the chip that the image was compiled for.
        self._model = chips.get(soft_chip_of(image))
        self._twin = NativeChip(image, seed, LogOptions(chip=self._model))
        self.differing: Counter[str] = Counter()
        self.n_steps = self.total_cycles = self.worst_cycles = 0
        self._closed = False

    @abstractmethod
    def _advance(
        self, messages: np.ndarray, expected: list[np.ndarray]
    ) -> tuple[int, list[np.ndarray]]:
        """Take a step with the host's messages, compare, and return cycles and outputs.

        ``expected`` are the native chip's outputs.
        """

    @abstractmethod
    def _free(self) -> None:
        """Free the soft cores."""

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        if self._closed:
            raise BackendError(CLOSED)
        expected = self._twin.step(spikes, errors)
        cycles, outputs = self._advance(self._memory.messages(np.asarray(spikes)), expected)
        self.n_steps += 1
        self.total_cycles += cycles
        self.worst_cycles = max(self.worst_cycles, cycles)
        return outputs

    def _compare(self, name: str, found: np.ndarray, expected: np.ndarray) -> None:
        if differs := int((found != expected).sum()):
            if not self.differing:
                self._say(
                    f"step {self.n_steps + 1:,} is the first that differs: {differs:,} {name}"
                )
            self.differing[name] += differs

    @property
    def log(self) -> StepLog:
        """The counts of the native chip's steps."""
        return self._twin.log

    def activity(self) -> Activity:
        """Return the native chip's counts."""
        return self._twin.activity()

    def close(self) -> None:
        """Free the soft cores, and say how many values differed and how many cycles steps took."""
        if self._closed:
            return
        self._closed = True
        with ExitStack() as stack:  # also if a line cannot be printed
            stack.callback(self._twin.close)
            stack.callback(self._free)
            if self.n_steps:
                for line in self._words():
                    self._say(line)

    def _words(self) -> Iterator[str]:
        """Yield a line on differing values, and one on measured and expected cycles."""
        n = self.n_steps * sum(self.compared.values())
        differing = ", ".join(f"{name} {self.differing[name]:,}" for name in self.compared)
        yield f"{n:,} states compared in {self.n_steps:,} steps; differing: {differing}"
        assert self._model.clock is not None
        expected = timing(self.activity(), self._model, self._model.calibrations[0])
        mean, worst = (
            one.value / self._model.clock.value for one in (expected.mean, expected.worst)
        )
        yield (
            f"cycles a step: {self.total_cycles / self.n_steps:,.0f} in the mean, "
            f"{self.worst_cycles:,} in the longest; expected for {self._model.name}: "
            f"{mean:,.0f} and {worst:,.0f}"
        )


class RtlChip(SoftChip):
    """An image on soft cores in Verilator, all states compared.

    Outputs are read through the cores' own port.

    Parameters
    ----------
    image, seed, say
        See `SoftChip`.
    build : Build, optional
        A chip to use instead of one with as many cores as are used.

    Raises
    ------
    MissingExtraError
        If Verilator is not installed.
    BackendError
        If a soft core cannot hold the image.
    """

    def __init__(
        self,
        image: ChipImage,
        seed: int,
        say: Callable[[str], None] = say_nothing,
        build: Build | None = None,
    ) -> None:
        memory = written(image) if build is None else written(image, build.unit, build.cores)
        super().__init__(image, seed, memory, say)
        self._simulation = Simulation(self._memory, build)
        self._outputs = outputs_of(image)
        self.compared = dict.fromkeys(STATE, len(self._memory.order))

    def _advance(
        self, messages: np.ndarray, _expected: list[np.ndarray]
    ) -> tuple[int, list[np.ndarray]]:
        cycles = self._simulation.step(messages).cycles
        order, state = self._memory.order, self._twin.state
        for place, name in enumerate(STATE):
            self._compare(name, self._simulation.state[:, place], getattr(state, name)[order])
        return cycles, [
            np.array([self._read(one) for one in ports], dtype=np.int32) for ports in self._outputs
        ]

    def _read(self, output: Output) -> int:
        return self._simulation.read(output.core, output.place)[PLACES[output.held]]

    def _free(self) -> None:
        self._simulation.close()


class DeviceChip(SoftChip):
    """An image on a board with soft cores, at the end of a line; all outputs compared.

    Parameters
    ----------
    image, seed
        See `SoftChip`.
    line : ByteLine
        The line; it is closed with the chip, and if the chip cannot be made.
    say
        See `SoftChip`.

    Raises
    ------
    BackendError
        If a soft core cannot hold the image, or the board does not answer as it should.
    """

    def __init__(
        self, image: ChipImage, seed: int, line: ByteLine, say: Callable[[str], None] = say_nothing
    ) -> None:
        self._line = line
        with ExitStack() as opened:
            opened.callback(line.close)
            if image.n_cores > port.MOST_CORES:
                raise BackendError(
                    f"the image uses {image.n_cores:,} cores, limit {port.MOST_CORES} of a board's "
                    "port; cure: --backend native, or compile it for a chip of soft cores"
                )
            super().__init__(image, seed, written(image), say)
            outputs = outputs_of(image)
            flat = [one for ports in outputs for one in ports]
            # The board sends values first, then spikes.
            self._sent_order = np.argsort([one.held == Held.SPIKE for one in flat], kind="stable")
            self._listed = [flat[i] for i in self._sent_order]
            self._ends = np.cumsum([len(ports) for ports in outputs], dtype=int)
            self.compared = {"outputs": len(flat)}
            self._load()
            opened.pop_all()

    def _load(self) -> None:
        """Load the board, and clear both banks of its sums."""
        self._line.restart(port.ASK)
        # The answer has the checksum of everything that was loaded.
        self._exchange(port.loading(self._memory, self._listed) + port.ASK)
        nothing = np.zeros((0, 2), dtype=np.int64)
        for _ in range(2):
            self._take(nothing, clear=True)

    def _advance(
        self, messages: np.ndarray, expected: list[np.ndarray]
    ) -> tuple[int, list[np.ndarray]]:
        answer = self._take(messages)
        values = np.empty(len(self._listed), dtype=np.int32)
        values[self._sent_order] = answer.values
        self._compare("outputs", values, np.concatenate([*expected, []]))
        return answer.cycles, np.split(values, self._ends)[:-1]  # the last part is empty

    def _take(self, messages: np.ndarray, clear: bool = False) -> port.Answer:
        for sent in port.stepping(messages, clear):
            answer = self._exchange(sent)
        return answer

    def _exchange(self, sent: bytes) -> port.Answer:
        received = self._line.exchange(sent, port.answer_bytes(self._listed))
        return port.answered(sent, received, self._listed)

    def _free(self) -> None:
        self._line.close()


def outputs_of(image: ChipImage) -> list[list[Output]]:
    """Return the registers that each output of an image reads."""
    core, place = image.compartment_core, image.compartment_place
    result = []
    for number, output in enumerate(image.manifest.outputs):
        read = image.read_by(number)
        places = zip(core[read].tolist(), place[read].tolist(), strict=True)
        result.append([Output(HELD[output.key], *one) for one in places])
    return result
