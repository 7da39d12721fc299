"""A board's serial line in Icarus Verilog: an image is loaded, stepped and read by bytes alone."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore import stream
from spikeport.backends.softcore.design import parameters
from spikeport.backends.softcore.stream import Held
from spikeport.backends.softcore.verilated import sources
from spikeport.backends.softcore.writer import written
from tests.helpers.fake_board import small_image, spike_train

BENCH = Path(__file__).with_name("board_bench.v")
STEPS = 8
LONG = 7
"""Pause for answers, in 20 bits of the line."""


def test_answers_are_signed_values_of_three_bytes() -> None:
    assert stream.answers(b"\x01\x02\x03\xff\xff\xff").tolist() == [0x030201, -1]


def test_a_message_is_four_bytes() -> None:
    assert stream.step(np.array([[2, 0x1234]])) == b"\x04\0\0\0\x03\x02\x12\x34"


@pytest.mark.skipif(shutil.which("iverilog") is None, reason="no iverilog: make referees")
def test_a_board_on_a_serial_line_has_the_native_states(tmp_path: Path) -> None:
    memory, native = written(small_image()), NativeChip(small_image(), 0)
    parts = [(stream.loading(memory), 2)]
    expected = []
    for spikes in spike_train(STEPS):
        native.step(spikes, {})
        parts.append((stream.step(memory.messages(spikes)) + stream.wait(), LONG))
        for what in Held:
            parts += [(stream.read(0, what, 0, 3), LONG), (stream.read(1, what, 0, 2), LONG)]
        state = native.state
        expected += [one[:5].copy() for one in (state.u, state.v, state.spiked)]
    pauses = b"".join(bytes(len(content) - 1) + bytes([pause]) for content, pause in parts)
    (tmp_path / "sent").write_bytes(b"".join(content for content, _ in parts))
    (tmp_path / "pauses").write_bytes(pauses)
    (tmp_path / "parameters.vh").write_text(parameters(memory, baud_cycles=4, log_queue=2))
    files = [*map(str, sources(board=True)), str(BENCH)]
    built = ["iverilog", "-g2012", "-o", "bench", "-s", "bench", f"-I{tmp_path}", *files]
    subprocess.run(built, cwd=tmp_path, check=True)
    subprocess.run(["vvp", "-n", "bench"], cwd=tmp_path, check=True, timeout=300)
    found = stream.answers((tmp_path / "answered").read_bytes())[2:]
    cycles, values = found.reshape(STEPS, 16)[:, 0], found.reshape(STEPS, 16)[:, 1:]
    assert (cycles > 10).all()
    np.testing.assert_array_equal(values.ravel(), np.concatenate(expected))
