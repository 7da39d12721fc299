"""CPU time of a step on a board's stub and in this process, and of frames and records.

    OPENBLAS_NUM_THREADS=1 python benchmarks/link.py IMAGE [--steps N] [--rounds N]

Both run the same image with the same random spikes of the host, in turn. The board's own CPU time,
its chip included, is read from /proc; the link costs the time of both processes minus native's.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from arguments import at_least
from markdown_table import table

from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.frame import Frame, Kind, Splitter
from spikeport.backends.board.line import SocketLine
from spikeport.backends.board.messages import Codec
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.sockets import connect
from spikeport.backends.board.stub import Stub
from spikeport.backends.chip import Chip
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage

SHARE = 0.5
"""The share of the host's sources that spike in a step, as on/off neurons do."""


def cpu_s(process: int) -> float:
    """Return the CPU time of a process so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stepped_us(chip: Chip, trains: list[np.ndarray], other: int | None) -> float:
    """Return the CPU time of a step, in us, including that of another process."""

    def now() -> float:
        return time.process_time() + (0.0 if other is None else cpu_s(other))

    begin = now()
    for spikes in trains:
        chip.step(spikes, {})
    return 1e6 * (now() - begin) / len(trains)


def timed_us(function: Callable[[], object], n: int = 2000) -> float:
    """Return the CPU time of a call, in us."""
    begin = time.process_time()
    for _ in range(n):
        function()
    return 1e6 * (time.process_time() - begin) / n


def parts_us(image: ChipImage, spikes: np.ndarray) -> dict[str, float]:
    """Return the CPU time of packing, framing and recording a step."""
    codec, splitter = Codec(image), Splitter()
    body, flags = codec.pack_step(spikes, {})
    state = codec.pack_state(codec.silence(), np.zeros((6, image.n_cores), dtype=int))
    frame = Frame(Kind.STATE, 1, 1, state)
    data = frame.encode()

    def split() -> None:
        splitter.feed(data)
        splitter.next()

    with tempfile.TemporaryDirectory() as folder:
        recorder = SessionRecorder(Path(folder) / "record")
        record_us = timed_us(lambda: recorder.step(1, flags, body, state))
        recorder.close()
    return {
        "pack and unpack a step": timed_us(lambda: codec.unpack_step(*codec.pack_step(spikes, {}))),
        "unpack a state": timed_us(lambda: codec.unpack_state(state)),
        "encode a frame": timed_us(frame.encode),
        "find and check a frame": timed_us(split),
        "record a step": record_us,
    }


def main() -> None:
    """Print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("image", type=Path)
    asked.add_argument("--steps", type=at_least(1), default=2000)
    asked.add_argument("--rounds", type=at_least(1), default=5)
    options = asked.parse_args()
    image, rng = ChipImage.load(options.image), np.random.default_rng(0)
    trains = [np.flatnonzero(rng.random(image.n_inputs) < SHARE) for _ in range(options.steps)]
    native, stub = NativeChip(image, 0), Stub()
    board = BoardChip(image, 0, SocketLine(connect(stub.address), "the board"))
    times: dict[str, list[float]] = {"native": [], "board, both processes": []}
    for _ in range(options.rounds):
        times["native"].append(stepped_us(native, trains, None))
        times["board, both processes"].append(stepped_us(board, trains, stub.process_id))
    figures = {name: statistics.median(values) for name, values in times.items()}
    figures["the link"] = figures["board, both processes"] - figures["native"]
    board.close()
    stub.close()
    rows = [[name, f"{us:.1f}"] for name, us in (figures | parts_us(image, trains[0])).items()]
    print(table(["a step", "CPU us"], rows))


if __name__ == "__main__":
    main()
