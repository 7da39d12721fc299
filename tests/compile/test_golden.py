"""Text printed after each pass: a command, a network and the expected lines in each golden file."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest
from typer.testing import CliRunner

from spikeport.cli import app
from tests.helpers.chip_files import chip_file

FILES = sorted((Path(__file__).parent / "golden").glob("*.txt"))
EDGE = "-" * 88
SMALL = {"compartments": 12, "in_axons": 32, "out_axons": 32, "synapse_bits": 2048}
AFTER = re.compile(r"^after \w+:\n(?:  .*\n)*", re.MULTILINE)


class Golden(NamedTuple):
    """The parts of a golden file: the command, the source of net.py, and what is printed."""

    command: str
    source: str
    expected: str

    @classmethod
    def read(cls, path: Path) -> "Golden":
        head, expected = path.read_text(encoding="utf-8").split(f"\n{EDGE}\n")
        command, _, source = head.partition("\n")
        return cls(command.removeprefix("$ "), source, expected)

    def run(self, folder: Path) -> str:
        """Return the command's lines after passes, in a folder with net.py and two chips."""
        chip_file(folder / "small.toml", **SMALL)
        chip_file(folder / "board.toml", **SMALL, cores=2, chips=3)
        (folder / "net.py").write_text(self.source, encoding="utf-8")
        program, *arguments = shlex.split(self.command)
        assert program == "spikeport"
        done = CliRunner().invoke(app, arguments, catch_exceptions=False)
        assert done.exit_code == 0
        return "".join(AFTER.findall(done.stdout))

    def write(self, path: Path, expected: str) -> None:
        path.write_text(f"$ {self.command}\n{self.source}\n{EDGE}\n{expected}", encoding="utf-8")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_text_after_passes_is_that_of_the_golden_file(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.chdir(tmp_path)
    golden = Golden.read(path)
    printed = golden.run(tmp_path)
    if request.config.getoption("--bless"):
        golden.write(path, printed)
    assert printed == Golden.read(path).expected
    assert printed.startswith("after ")
