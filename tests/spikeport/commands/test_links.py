"""Options of a link that would do nothing are refused, and files are not written over."""

from pathlib import Path
from typing import Any

import pytest

from spikeport.backends.board.link import LinkOptions
from spikeport.commands.links import certificates, link_options
from spikeport.commands.options import Link, Tls
from spikeport.errors import BackendError, UsageError


def link(**options: Any) -> Link:
    return Link(**{"fault": [], **options})


def test_options_of_a_run_without_a_board_are_the_defaults() -> None:
    assert link_options(link(), Tls(), "native") == LinkOptions()


def test_options_reach_the_board() -> None:
    asked = link(board="unix:x", real_time=True, hold=3, record=Path("r"))
    files = Tls(cert=Path("c"), key=Path("k"), ca=Path("a"))
    made = link_options(asked, files, "board")
    assert (made.board, made.real_time, made.hold) == ("unix:x", True, 3)
    assert made.certificates is not None
    assert made.certificates.authority == Path("a")


@pytest.mark.parametrize(
    ("options", "backend", "reason"),
    [
        ({"real_time": True}, "native", "are for --backend board, not native"),
        ({"fault": ["cut@1"]}, "replay", "are for --backend board, not replay"),
        ({"replay": Path("x")}, "board", "--replay is for --backend replay, not board"),
        ({"fault": ["nonsense"]}, "board", "write KIND@STEP"),
        ({}, "replay", "name it, --replay FILE"),
    ],
)
def test_options_that_would_do_nothing_are_refused(
    options: dict[str, Any], backend: str, reason: str
) -> None:
    with pytest.raises(UsageError, match=reason):
        link_options(link(**options), Tls(), backend)


def test_a_record_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "record"
    path.write_text("precious")
    with pytest.raises(UsageError, match="is there already; choose another file"):
        link_options(link(record=path), Tls(), "board")


def test_what_is_no_record_is_refused_before_a_compile(tmp_path: Path) -> None:
    path = tmp_path / "record"
    with pytest.raises(BackendError, match="no such file"):
        link_options(link(replay=path), Tls(), "replay")
    path.write_text("no record")
    with pytest.raises(BackendError, match="no record of a board's session"):
        link_options(link(replay=path), Tls(), "replay")


def test_tls_takes_all_three_files() -> None:
    with pytest.raises(UsageError, match="three files: --cert, --key and --ca"):
        certificates(Tls(cert=Path("c")))
