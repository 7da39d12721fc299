"""Compilation of snips by gcc, and messages of its absence and its errors."""

import shutil
from pathlib import Path

import pytest

from spikeport.backends.board.nxsdk.compiled import compiled, require_gcc
from spikeport.backends.board.nxsdk.package import Phase
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.errors import BackendError, MissingExtraError


def test_without_gcc_the_error_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingExtraError, match=r"no gcc is installed here.*apt-get install g"):
        require_gcc()


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_the_compiler_s_error_in_a_snip_is_quoted(tmp_path: Path) -> None:
    (tmp_path / "chip.c").write_text("int f(void) { return nothing; }")
    board = Board(1, 1, [1], [[0]])
    path = str(tmp_path / "chip.c")
    board.createSnip(Phase.EMBEDDED_MGMT, cFilePath=path, includeDir=str(tmp_path))
    board.createSnip(Phase.HOST_CONCURRENT_EXECUTION, cppFile=path)
    with pytest.raises(BackendError, match=r"nengo-loihi's snips do not compile: .*chip\.c"):
        compiled(board)
