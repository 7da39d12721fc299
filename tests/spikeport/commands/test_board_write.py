"""`board write`: files for an FPGA, of an image."""

from pathlib import Path

import pytest

from spikeport.backends.softcore import port
from spikeport.backends.softcore.writer import written
from spikeport.commands.board_write import run
from spikeport.errors import BackendError
from tests.helpers.fake_board import small_image
from tests.helpers.images import Block, Parts


def test_it_writes_what_the_verilog_includes_and_what_loads_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small_image().save(tmp_path / "image.npz")
    run(tmp_path / "image.npz", tmp_path / "out", log_queue=8, row_words=2048)
    parameters = (tmp_path / "out" / "parameters.vh").read_text()
    assert "`define LOG_QUEUE 8\n" in parameters
    assert "`define WORDS {20'd2048, 20'd2048}\n" in parameters
    loading = (tmp_path / "out" / "load.bin").read_bytes()
    assert port.loading(written(small_image()), [])[:-10] in loading
    printed = capsys.readouterr().out
    assert f"memory image {written(small_image()).digest[:16]} of image" in printed
    assert f"load.bin: {len(loading)} bytes" in printed


def test_what_a_core_cannot_hold_is_refused(tmp_path: Path) -> None:
    Parts(blocks=[Block(enable_noise=1)]).image().save(tmp_path / "image.npz")
    with pytest.raises(BackendError, match="1 compartments have noise"):
        run(tmp_path / "image.npz", tmp_path / "out", log_queue=8, row_words=2048)
    assert not (tmp_path / "out").exists()
