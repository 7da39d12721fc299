"""Soft cores beyond what Verilator steps by itself: the link of a board, and rows in an SDRAM.

    python benchmarks/softcore.py link IMAGE RECORD [--baud-cycles 15] [--first 20] [--steps 60]
    python benchmarks/softcore.py sdram IMAGE RECORD [--first 1000] [--steps 500]

RECORD is what `spikeport run NAME --backend board --record FILE` wrote, and IMAGE the same run's:
the spikes that the host sends in closed loop. `link` counts cycles of a board in Verilator from the
first byte of a step to the last one of its answer; 0 baud cycles are a FIFO to USB. `sdram` reckons
how long the rows of a step take through one SDRAM, with the times of its data sheet and without any
wait for what asks. The first steps, until a network is awake, are taken and not counted.
"""

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from spikeport.backends.board.messages import Codec
from spikeport.backends.board.record import Record
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore.chip import DeviceChip, outputs_of
from spikeport.backends.softcore.decompile import messages_of
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.line import VerilatedLine
from spikeport.backends.softcore.rows import size_of
from spikeport.backends.softcore.verilated import BoardBuild
from spikeport.backends.softcore.writer import MODEL, written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.hardware_models import chip as chips

CLOCK_HZ = 45e6


def spikes_of(image: ChipImage, record: Path) -> Iterator[np.ndarray]:
    """Yield the sources on the host that spike, step by step."""
    codec = Codec(image)
    for step in Record(record).steps():
        yield codec.unpack_step(step.sent, step.flags)[0]


def link(image: ChipImage, steps: Iterable[np.ndarray], first: int, baud_cycles: int) -> None:
    """Print the cycles of a step, of which the cores and the link."""
    memory = written(image)
    n_outputs = sum(map(len, outputs_of(image, memory.order)))
    pool = chips.get(MODEL).soft_memory
    assert pool is not None
    line = VerilatedLine(BoardBuild(parameters(memory, n_outputs, pool), baud_cycles), CLOCK_HZ)
    chip = DeviceChip(image, 0, line, print)
    rows = []
    for spikes in steps:
        before = chip.total_cycles
        chip.step(spikes, {})
        rows.append((line.cycles, chip.total_cycles - before, len(memory.messages(spikes))))
    whole, cores, sent = np.array(rows[first:]).T
    for name, cycles in (("step", whole), ("cores", cores), ("link", whole - cores)):
        mean, most = cycles.mean(), cycles.max()
        times = " and ".join(f"{1e6 * one / CLOCK_HZ:,.0f} us" for one in (mean, most))
        print(f"{name}: {mean:,.0f} cycles in the mean, {most:,} at most; at 45 MHz {times}")
    print(f"messages of the host: {sent.mean():.0f} in the mean, {sent.max()} at most")
    chip.close()


@dataclass(frozen=True)
class Sdram:
    """An SDRAM of 16 bits and its controller, which knows a row before the one that it reads.

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

        activate   when the bank is precharged and the data before begins
        data       t_rcd and the CAS latency later, when the bus is free; a word a cycle
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


def sdram(image: ChipImage, steps: Iterable[np.ndarray], first: int) -> None:
    """Print words and time of a step's rows, all cores after each other, and cycles of walkers."""
    memory, chip, model = written(image), NativeChip(image, 0), Sdram()
    sizes = [len(core.rows) for core in memory.cores]
    base = np.cumsum([0, *sizes])
    lists = messages_of(memory)
    sizes_of = {one: size_of(memory.cores[one[0]].rows, one[1]) for some in lists for one in some}
    n, found = len(memory.order), []
    for step, spikes in enumerate(steps):
        chip.step(spikes, {})
        if step < first:
            continue
        sources = [*np.flatnonzero(chip.state.spiked[:n]), *(n + spikes)]
        messages = [one for source in sources for one in lists[source]]
        walkers = np.zeros(len(memory.cores), dtype=np.int64)
        for one in messages:
            walkers[one[0]] += 2 + sizes_of[one][1]
        rows = [(int(base[one[0]]) + one[1], sizes_of[one][0]) for one in messages]
        found.append(
            (sum(words for _, words in rows), len(rows), walkers.max(), model.time_ns(rows) / 1e6)
        )
    words, messages, walkers, time_ms = np.array(found).T
    print(f"rows: {sum(sizes) / 512:,.0f} KiB on {len(sizes)} cores")
    print(f"words of 16 bits a step: {words.mean():,.0f} in the mean, {words.max():,.0f} at most")
    print(f"messages a step: {messages.mean():,.0f} in the mean, {messages.max():,.0f} at most")
    print(f"fullest walker: {walkers.mean():,.0f} cycles in the mean, {walkers.max():,.0f} at most")
    print(f"one SDRAM: {time_ms.mean():.2f} ms a step in the mean, {time_ms.max():.2f} ms at most")


def main() -> None:
    """Run one of the two."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("what", choices=("link", "sdram"))
    parser.add_argument("image", type=ChipImage.load)
    parser.add_argument("record", type=Path)
    parser.add_argument("--baud-cycles", type=int, default=15)
    parser.add_argument("--first", type=int, default=20)
    parser.add_argument("--steps", type=int, default=60)
    asked = parser.parse_args()
    steps = islice(spikes_of(asked.image, asked.record), asked.first + asked.steps)
    if asked.what == "link":
        link(asked.image, steps, asked.first, asked.baud_cycles)
    else:
        sdram(asked.image, steps, asked.first)


if __name__ == "__main__":
    main()
