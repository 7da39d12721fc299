"""The build of the core in Verilator, and the refusal where there is none."""

from pathlib import Path

import pytest

from spikeport.backends.softcore import verilated
from spikeport.backends.softcore.verilated import PROGRAMS, Build, require_verilator, sources
from spikeport.errors import BackendError, MissingExtraError


def test_without_verilator_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingExtraError, match=r"no verilator .*: apt-get install verilator"):
        require_verilator()


def test_a_verilator_that_does_not_start_raises_an_error_of_the_backend(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for program in PROGRAMS:
        (tmp_path / program).write_text("#!/bin/sh\necho no perl >&2; exit 2\n")
        (tmp_path / program).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BackendError, match="the soft core is not built: no perl"):
        require_verilator()


def test_verilator_is_given_no_path_which_might_have_a_space(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commands: list[list[str]] = []

    def build(command: list[str], _failure: str, _limit_s: float, folder: str) -> None:
        commands.append(command)
        assert all((Path(folder) / path.name).is_file() for path in sources())
        (Path(folder) / "softcore.so").write_bytes(b"library")

    monkeypatch.setattr(verilated, "output_of", build)
    assert verilated._built(Build(2)).tobytes() == b"library"
    assert not any("/" in argument for argument in commands[0])


def test_the_number_of_a_core_has_as_many_bits_as_it_needs() -> None:
    assert {"-GCORES=6", "-GCORE=3", "-GWIDTH=16"} <= set(Build(6, unit=6).options)


def test_every_file_of_verilog_begins_with_a_comment_and_is_short() -> None:
    assert len(sources()) == 10
    for path in sources():
        text = path.read_text(encoding="utf-8")
        assert text.startswith("// "), path.name
        assert len(text.splitlines()) < 140, path.name
