"""`RtlChip`: an image on soft cores in Verilator, with the native chip beside it."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore.simulation import STATE, Simulation
from spikeport.backends.softcore.verilated import Build
from spikeport.backends.softcore.writer import MODEL, written
from spikeport.backends.step_log import LogOptions, StepLog
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.errors import BackendError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.timing import timing

HELD = {"current": 0, "voltage": 1, "spiked": 2}
"""The register of each kind of output, by its place at the chip's port."""


def say_nothing(_line: str) -> None:
    """Say nothing."""


class RtlChip:
    """An image on soft cores. Implements `spikeport.backends.board.board.CountingChip`.

    Outputs are read by the cores' own port. The native chip steps beside it: counts are of that
    one, and all state of all compartments is compared after every step.

    Parameters
    ----------
    image : ChipImage
        The image.
    seed : int
        A seed of no effect: what draws random numbers is refused.
    say : callable
        Is called at the end with a line on states that differ, and one on cycles.
    build : Build, optional
        Another chip than that with as many cores as are used.

    Attributes
    ----------
    differing : Counter of str
        States that differed, by the names of `STATE`.
    n_steps, total_cycles, worst_cycles : int
        Steps, and their cycles: the sum, and the longest step.

    Raises
    ------
    MissingExtraError
        If Verilator is not installed.
    BackendError
        If a soft core cannot hold the image.
    """

    link: dict[str, object] | None = None

    def __init__(
        self,
        image: ChipImage,
        seed: int,
        say: Callable[[str], None] = say_nothing,
        build: Build | None = None,
    ) -> None:
        chip = () if build is None else (build.unit, build.cores)
        self._memory = written(image, *chip)
        self._simulation = Simulation(self._memory, build)
        self._model, self._say = chips.get(MODEL), say
        self._twin = NativeChip(image, seed, LogOptions(chip=self._model))
        self.differing: Counter[str] = Counter()
        self.n_steps = self.total_cycles = self.worst_cycles = 0
        self._ports = _ports(image, self._memory.order)
        self._closed = False

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        if self._closed:
            raise BackendError("the chip is closed: it cannot step any more")
        self._twin.step(spikes, errors)
        cycles = self._simulation.step(self._memory.messages(np.asarray(spikes))).cycles
        self.n_steps += 1
        self.total_cycles += cycles
        self.worst_cycles = max(self.worst_cycles, cycles)
        n, order = len(self._memory.order), self._memory.order
        for place, name in enumerate(STATE):
            expected = getattr(self._twin.state, name)[:n][order]
            differs = int((expected != self._simulation.state[:, place]).sum())
            if differs:
                self.differing[name] += differs
        return [
            np.array([self._simulation.read(*at)[held] for at in ports], dtype=np.int32)
            for held, ports in self._ports
        ]

    @property
    def log(self) -> StepLog:
        """The counts of the native chip's steps."""
        return self._twin.log

    def activity(self) -> Activity:
        """Return the native chip's counts."""
        return self._twin.activity()

    def close(self) -> None:
        """Free the simulation, and say what differed and how many cycles steps took."""
        if self._closed:
            return
        self._closed = True
        if self.n_steps:
            for line in self._words():
                self._say(line)
        self._simulation.close()
        self._twin.close()

    def _words(self) -> Iterator[str]:
        """Yield what differed, and cycles beside those of the chip's file."""
        n = self.n_steps * len(self._memory.order) * len(STATE)
        differing = ", ".join(f"{name} {self.differing[name]:,}" for name in STATE)
        yield f"{n:,} states compared in {self.n_steps:,} steps; differing: {differing}"
        assert self._model.clock is not None
        expected = timing(self.activity(), self._model, self._model.calibrations[0])
        mean, worst = (
            one.value / self._model.clock.value for one in (expected.mean, expected.worst)
        )
        yield (
            f"cycles a step: {self.total_cycles / self.n_steps:,.0f} in the mean, "
            f"{self.worst_cycles:,} in the longest; expected of {MODEL}: {mean:,.0f} and "
            f"{worst:,.0f}"
        )


def _ports(image: ChipImage, order: np.ndarray) -> list[tuple[int, list[tuple[int, int]]]]:
    """Return for each output what it reads, and core and place there of each compartment."""
    core = image.compartment_core
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order)) - np.searchsorted(core[order], core[order])
    result = []
    for number, output in enumerate(image.manifest.outputs):
        read = image.reads.compartment[part(image.outputs.start, number)]
        ports = list(zip(core[read].tolist(), place[read].tolist(), strict=True))
        result.append((HELD[output.key], ports))
    return result
