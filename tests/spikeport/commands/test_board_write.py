"""`board write` leaves what a board is built of and loaded with."""

from pathlib import Path

import pytest

from spikeport.backends.softcore import stream
from spikeport.backends.softcore.writer import written
from spikeport.commands.board_write import run
from tests.helpers.fake_board import small_image


def test_both_files_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small_image().save(tmp_path / "image.npz")
    run(tmp_path / "image.npz", tmp_path / "out", baud_cycles=25, log_queue=9)
    memory = written(small_image())
    assert (tmp_path / "out" / "load.bin").read_bytes() == stream.loading(memory)
    assert "`define CORES 2\n" in (tmp_path / "out" / "parameters.vh").read_text()
    printed = capsys.readouterr().out
    assert f"memory image {memory.digest[:16]} of image {small_image().digest[:16]}\n" in printed
    assert ": 3 compartments, 3 output axons, 0.0 KiB of rows\n" in printed
