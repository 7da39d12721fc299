"""Soft cores with the link of a board in Verilator, or with their rows in an SDRAM.

    python benchmarks/softcore.py link --listen unix:/tmp/board [--baud-cycles 15] [--first 600]
    python benchmarks/softcore.py sdram --listen unix:/tmp/board [--first 1000]
    spikeport run reach --seconds 0.66 --backend board --board unix:/tmp/board

Each is a board that runs any image in closed loop, and prints its figures after the session. `link`
counts cycles of a board in Verilator from the first byte of a step to the last one of its answer; 0
baud cycles mean a FIFO to USB. `sdram` computes how long reading the rows of a step from one SDRAM
takes, with the times of its data sheet, and a controller that never waits. The first steps, before
a network is active, do not count.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from spikeport.backends.board.address import Address
from spikeport.backends.board.board import Machine
from spikeport.backends.board.server import Service, serve
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore.chip import DeviceChip, outputs_of
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.line import VerilatedLine
from spikeport.backends.softcore.verilated import BoardBuild
from spikeport.backends.softcore.writer import LARGEST_CHIP, written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.hardware_models import chip as chips

CLOCK_HZ = 45e6


class LinkedChip(DeviceChip):
    """A board in Verilator at the end of a line, which at last reports the cycles of steps.

    Parameters
    ----------
    image, seed
        See `DeviceChip`.
    first : int
        Steps that do not count.
    baud_cycles : int
        Clock cycles per bit of the serial line; 0 for a FIFO to USB.
    """

    def __init__(self, image: ChipImage, seed: int, *, first: int, baud_cycles: int) -> None:
        memory, pool = written(image), chips.get(LARGEST_CHIP).soft_memory
        assert pool is not None
        n_outputs = sum(map(len, outputs_of(image)))
        build = BoardBuild(parameters(memory, n_outputs, pool), baud_cycles)
        self._line_in_verilator = VerilatedLine(build, CLOCK_HZ)
        self._first, self._found = first, list[tuple[int, int, int]]()
        super().__init__(image, seed, self._line_in_verilator, say)

    def _advance(
        self, messages: np.ndarray, expected: list[np.ndarray]
    ) -> tuple[int, list[np.ndarray]]:
        cycles, outputs = super()._advance(messages, expected)
        self._found.append((self._line_in_verilator.cycles, cycles, len(messages)))
        return cycles, outputs

    def _words(self) -> Iterator[str]:
        yield from super()._words()
        if not (counted := self._found[self._first :]):
            return
        whole, cores, sent = np.array(counted).T
        for name, cycles in (("step", whole), ("cores", cores), ("link", whole - cores)):
            mean, most = cycles.mean(), cycles.max()
            times = " and ".join(f"{1e6 * one / CLOCK_HZ:,.0f} us" for one in (mean, most))
            yield f"{name}: {mean:,.0f} cycles in the mean, {most:,} at most; at 45 MHz {times}"
        yield f"messages of the host: {sent.mean():.0f} in the mean, {sent.max()} at most"


@dataclass(frozen=True)
class Sdram:
    """An SDRAM of 16 bits and its controller, which looks one row ahead.

    Times in ns, of an IS42S16160G-7 (ISSI's data sheet), the 32 MiB of a ULX3S. A row of the SDRAM
    has ``page`` words; pages that follow each other lie in different banks.
    """

    period: float = 7.0
    cas_cycles: int = 3
    rcd: float = 15.0
    rp: float = 15.0
    rc: float = 60.0
    rfc: float = 60.0
    refresh: float = 7812.5
    page: int = 512
    banks: int = 4

    def time_ns(self, rows: Iterable[tuple[int, int]]) -> float:
        """Return the time of reading rows, each an address and a number of words, one by one.

        activate   when the bank is precharged and the previous data begin
        data       t_rcd and the CAS latency later, when the bus is free; one word per cycle
        """
        bus = started = 0.0
        ready = [0.0] * self.banks
        refreshes = 0
        for address, words in rows:
            while words:
                page, column = divmod(address, self.page)
                n, bank = min(words, self.page - column), page % self.banks
                if bus > (refreshes + 1) * self.refresh:
                    refreshes += 1
                    bus = started = max(bus, *ready) + self.rp + self.rfc
                activated = max(ready[bank], started)
                started = max(activated + self.rcd + self.cas_cycles * self.period, bus)
                bus = started + n * self.period
                ready[bank] = max(activated + self.rc, bus + self.rp)
                address, words = address + n, words - n
        return bus


def size_of(words: np.ndarray, at: int) -> tuple[int, int]:
    """Return the numbers of words and entries of the row at an address."""
    header = int(words[at])
    entries = (header & 0x3FF) + 1
    return 2 + (-(-entries // 2) if header >> 10 & 1 else entries), entries


class SdramChip(NativeChip):
    """A native chip that computes the time of reading a step's rows from one SDRAM, one by one.

    Parameters
    ----------
    image, seed
        See `NativeChip`.
    first : int
        Steps that do not count.
    """

    def __init__(self, image: ChipImage, seed: int, *, first: int) -> None:
        super().__init__(image, seed)
        memory = written(image)
        self._first, self._n, self._sdram = first, len(memory.order), Sdram()
        sizes = [len(core.rows) for core in memory.cores]
        self._n_cores, self._kib, base = len(sizes), sum(sizes) / 512, np.cumsum([0, *sizes])
        # The rows of each source's messages: core, address in the SDRAM, words and entries.
        self._rows = [
            [
                (core, int(base[core]) + at, *size_of(memory.cores[core].rows, at))
                for core, at in some
            ]
            for some in memory.messages_by_source()
        ]
        self._steps, self._found = 0, list[tuple[int, int, int, float]]()

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`."""
        outputs = super().step(spikes, errors)
        self._steps += 1
        if self._steps > self._first:
            sources = [*np.flatnonzero(self.state.spiked[: self._n]), *(self._n + spikes)]
            self._count([row for source in sources for row in self._rows[source]])
        return outputs

    def _count(self, rows: list[tuple[int, int, int, int]]) -> None:
        walkers = np.zeros(self._n_cores, dtype=np.int64)
        for core, _, _, entries in rows:
            walkers[core] += 2 + entries
        words = sum(words for _, _, words, _ in rows)
        time_ns = self._sdram.time_ns((at, words) for _, at, words, _ in rows)
        self._found.append((words, len(rows), int(walkers.max()), time_ns / 1e6))

    def close(self) -> None:
        """Print words and time of a step's rows, and cycles of the fullest core's walker."""
        super().close()
        if not self._found:
            return
        words, messages, walkers, time_ms = np.array(self._found).T
        say(f"rows: {self._kib:,.0f} KiB")
        for name, counts in (
            ("words of 16 bits a step", words),
            ("messages a step", messages),
            ("cycles of the fullest walker", walkers),
        ):
            say(f"{name}: {counts.mean():,.0f} in the mean, {counts.max():,.0f} at most")
        say(
            f"one SDRAM: {time_ms.mean():.2f} ms a step in the mean, {time_ms.max():.2f} ms at most"
        )
        self._found.clear()


def say(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def main() -> None:
    """Serve one of the two boards for a session."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("board", choices=("link", "sdram"))
    parser.add_argument("--listen", type=Address.parse, required=True)
    parser.add_argument("--baud-cycles", type=int, default=15)
    parser.add_argument("--first", type=int, default=600)
    asked = parser.parse_args()
    load: Callable[[ChipImage, int], LinkedChip | SdramChip] = partial(SdramChip, first=asked.first)
    if asked.board == "link":
        load = partial(LinkedChip, first=asked.first, baud_cycles=asked.baud_cycles)
    serve(Service(address=asked.listen, machine=Machine(asked.board, load), once=True), say)


if __name__ == "__main__":
    main()
