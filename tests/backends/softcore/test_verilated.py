"""The build of the core in Verilator, and the refusal where there is none."""

from pathlib import Path

import pytest

from spikeport.backends.softcore.verilated import Build, require_verilator, sources
from spikeport.errors import MissingExtraError


def test_without_verilator_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingExtraError, match=r"no verilator .*: apt-get install verilator"):
        require_verilator()


def test_the_number_of_a_core_has_as_many_bits_as_it_needs() -> None:
    assert {"-GCORES=6", "-GCORE=3", "-GWIDTH=16"} <= set(Build(6, unit=6).options)


def test_every_file_of_verilog_says_what_it_computes() -> None:
    assert len(sources()) == 10
    for path in sources():
        text = path.read_text(encoding="utf-8")
        assert text.startswith("// "), path.name
        assert len(text.splitlines()) < 140, path.name
