"""A board's Verilog at the end of a simulated line: loaded, stepped and read by bytes alone."""

import os
import shutil
import termios
import tty
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from spikeport.backends.native.chip import NativeChip
from spikeport.backends.softcore import port
from spikeport.backends.softcore.chip import DeviceChip
from spikeport.backends.softcore.line import SerialLine, VerilatedLine
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError, UsageError
from tests.helpers.fake_board import small_image, spike_train
from tests.helpers.images import Block, Group, Output, Parts, Route
from tests.helpers.soft_boards import BAUD_CYCLES, FIFO, board_line

SMALL = small_image()
ONE_CORE = Parts(
    blocks=[Block(n=3, bias=[40, 90, 300], vth=1000, decay_v=100)],
    groups=[Group(weights=[[64, -64, 128]] * 5)],
    inputs=[5],
    routes=[Route(axon=[0, 1, 2, 3, 4], input=0)],
    outputs=[Output("spiked", [0, 1, 2])],
)
"""An image for a chip of one core, so that messages can name one that is not there."""
ON = {BAUD_CYCLES: (ONE_CORE.image(), 3), FIFO: (SMALL, 6)}
"""The image, and its number of outputs, that boards of each link are built for.

To build another board takes 15 s.
"""
ROW_BYTE, CORE_BYTE = 1, 3
"""Bytes of a message, {core 8, row 16}, counted from its end."""

in_verilator = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("verilator") is None, reason="no verilator: make referees"),
]


def in_simulation(*values: float) -> object:
    return pytest.param(*values, marks=in_verilator)


def assert_same(
    line: VerilatedLine, steps: list[np.ndarray], image: ChipImage = SMALL
) -> list[str]:
    """Compare all outputs of all steps with the native chip's; return what the board says."""
    printed: list[str] = []
    chip = DeviceChip(image, 0, line, printed.append)
    native = NativeChip(image, 0)
    for spikes in steps:
        for found, expected in zip(chip.step(spikes, {}), native.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(found, expected)
    assert chip.differing == {}
    chip.close()
    return printed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("baud_cycles", "baud_error"),
    [
        in_simulation(BAUD_CYCLES, 0.0),
        in_simulation(BAUD_CYCLES, 0.02),
        in_simulation(BAUD_CYCLES, -0.02),
        in_simulation(FIFO, 0.0),
    ],
)
def test_a_board_has_the_native_outputs(baud_cycles: int, baud_error: float) -> None:
    image, n_outputs = ON[baud_cycles]
    crowd = [np.repeat(np.arange(3), 100)]  # more messages than a part of a step holds
    printed = assert_same(
        board_line(image, baud_cycles, baud_error), spike_train(30) + crowd * 3, image
    )
    assert printed[0] == f"{33 * n_outputs} states compared in 33 steps; differing: outputs 0"
    assert printed[1].startswith("cycles a step: ")


class Disturbed:
    """A line to a board that flips a bit of a byte, counted back from the request for an answer."""

    def __init__(self, line: VerilatedLine) -> None:
        self._line = line
        self.restart, self.close = line.restart, line.close
        self.flips = 0

    def exchange(self, sent: bytes, n: int) -> bytes:
        changed = bytearray(sent)
        if self.flips:
            changed[-len(port.ASK) - self.flips] ^= 1
        return self._line.exchange(bytes(changed), n)


def test_an_image_of_more_cores_than_an_axon_can_name_is_refused() -> None:
    image = Parts([Block(core=core) for core in range(129)]).image()
    line = Mock()
    with pytest.raises(BackendError, match="uses 129 cores, limit 128 of a board's port; cure: "):
        DeviceChip(image, 0, line)
    line.close.assert_called_once_with()


def test_a_line_without_an_answer_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spikeport.backends.softcore.line.PATIENCE_S", 0.05)
    ours, theirs = os.openpty()
    tty.setraw(ours)
    line = SerialLine(Path(os.ttyname(theirs)), 115200)
    with pytest.raises(BackendError, match="answered 0 of"):
        DeviceChip(small_image(), 0, line)
    with pytest.raises(OSError, match="Bad file descriptor"):
        line.close()
    os.close(ours)
    os.close(theirs)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("verilator") is None, reason="no verilator: make referees")
@pytest.mark.parametrize(("link", "flips"), [(FIFO, ROW_BYTE), (BAUD_CYCLES, CORE_BYTE)])
def test_a_bit_that_flips_on_the_line_ends_the_session_and_the_next_one_is_right(
    link: int, flips: int
) -> None:
    image, _ = ON[link]
    line = Disturbed(board_line(image, link))
    chip = DeviceChip(image, 0, line)
    chip.step(np.array([0]), {})
    line.flips = flips
    with pytest.raises(BackendError, match=r"checksum .*: the line changed or lost some"):
        chip.step(np.array([1]), {})
    line.flips = 0
    line._line.exchange(port.loading(chip._memory, [])[:11], 0)  # a command that breaks off
    assert_same(line, spike_train(10), image)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("verilator") is None, reason="no verilator: make referees")
def test_a_step_of_an_image_without_outputs_returns_an_empty_list() -> None:
    image = replace(ONE_CORE, outputs=[]).image()
    chip = DeviceChip(image, 0, board_line(image, BAUD_CYCLES))
    assert chip.step(np.array([0]), {}) == []
    chip.close()


def test_a_serial_line_carries_bytes_both_ways() -> None:
    ours, theirs = os.openpty()
    line = SerialLine(Path(os.ttyname(theirs)), 115200)
    os.write(ours, b"from before")
    line.restart(b"?")
    assert os.read(ours, 10) == b"?"
    os.write(ours, b"\x00\x0a\x0dwhole")
    assert line.exchange(b"\x03\x0a", 8) == b"\x00\x0a\x0dwhole"
    assert os.read(ours, 10) == b"\x03\x0a"
    os.close(ours)
    with pytest.raises(BackendError, match="the line to the board"):
        line.exchange(b"", 1)
    line.close()
    os.close(theirs)


def test_a_serial_line_does_not_keep_its_last_user_s_settings() -> None:
    ours, theirs = os.openpty()
    settings = termios.tcgetattr(theirs)
    settings[0] |= termios.IGNCR | termios.INLCR | termios.IXOFF
    settings[2] |= termios.CRTSCTS | termios.CSTOPB
    termios.tcsetattr(theirs, termios.TCSANOW, settings)
    line = SerialLine(Path(os.ttyname(theirs)), 115200)
    input_flags, _, control, *_ = termios.tcgetattr(theirs)
    assert not input_flags & (termios.IGNCR | termios.INLCR | termios.IXOFF)
    assert not control & (termios.CRTSCTS | termios.CSTOPB)
    os.write(ours, b"a\rb\nc")
    assert line.exchange(b"", 5) == b"a\rb\nc"
    line.close()


def test_a_serial_line_that_is_in_use_is_refused_and_keeps_what_has_arrived() -> None:
    ours, theirs = os.openpty()
    path = Path(os.ttyname(theirs))
    line = SerialLine(path, 115200)
    os.write(ours, b"answer")
    with pytest.raises(UsageError, match="is in use by another process"):
        SerialLine(path, 115200)
    assert line.exchange(b"", 6) == b"answer"
    line.close()
    SerialLine(path, 115200).close()


def test_a_device_that_sends_without_being_asked_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("spikeport.backends.softcore.line.PATIENCE_S", 0.0)
    ours, theirs = os.openpty()
    line = SerialLine(Path(os.ttyname(theirs)), 115200)
    os.write(ours, b"$GPGGA,")
    with pytest.raises(BackendError, match="the device sends without being asked; cure: name the"):
        line.restart(b"?")
    line.close()
    os.close(ours)
    os.close(theirs)


def test_an_answer_that_is_too_short_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spikeport.backends.softcore.line.PATIENCE_S", 0.05)
    ours, theirs = os.openpty()
    tty.setraw(ours)
    line = SerialLine(Path(os.ttyname(theirs)), 115200)
    os.write(ours, b"ab")
    with pytest.raises(BackendError, match=r"answered 2 of 5 bytes within 0.05 s; cure: load the"):
        line.exchange(b"x", 5)
    line.close()


def test_paths_that_are_not_serial_lines_and_unknown_rates_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be opened: No such file"):
        SerialLine(tmp_path / "none")
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="is no serial line: "):
        SerialLine(tmp_path / "file")
    with pytest.raises(UsageError, match="baud 1,234: this computer's serial lines"):
        SerialLine(tmp_path / "file", 1234)
