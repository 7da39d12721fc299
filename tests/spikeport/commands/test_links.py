"""Options of the link to a board: refusals of options without effect, and files that are kept."""

from pathlib import Path
from typing import Any

import pytest

from spikeport.backends.board.link import LinkOptions
from spikeport.commands.links import certificates, link_options
from spikeport.commands.options_of_links import Link, Tls
from spikeport.errors import UsageError
from tests.helpers.certificates import certificates as made_certificates


def link(**options: Any) -> Link:
    return Link(**{"fault": [], **options})


def test_options_of_a_run_without_a_board_are_the_defaults() -> None:
    assert link_options(link(), Tls(), "native") == LinkOptions()


def test_options_of_a_run_on_a_board_are_passed_to_its_link(tmp_path: Path) -> None:
    record, board = tmp_path / "folder" / "record", "tcp://127.0.0.1:80"
    asked = link(board=board, real_time=True, hold=3, record=record)
    files = made_certificates(tmp_path, "host")
    tls = Tls(cert=files.certificate, key=files.key, ca=files.authority)
    made = link_options(asked, tls, "board")
    assert (made.board, made.real_time, made.hold) == (board, True, 3)
    assert made.certificates == files
    assert not record.parent.exists()


@pytest.mark.parametrize(
    ("asked", "tls", "reason"),
    [
        (link(board="x"), Tls(), "write stub, unix:PATH or tcp://HOST:PORT"),
        (
            link(board="tcp://192.0.2.1:80"),
            Tls(),
            "a board on another machine needs TLS; give --cert",
        ),
        (
            link(board="tcp://127.0.0.1:80"),
            Tls(cert=Path("/c"), key=Path("/k"), ca=Path("/a")),
            "TLS: /c: no such file",
        ),
        (
            link(record=Path("/dev/null/x")),
            Tls(),
            "--record /dev/null/x: /dev/null is no folder; choose",
        ),
    ],
)
def test_wrong_addresses_certificates_and_records_are_refused(
    asked: Link, tls: Tls, reason: str
) -> None:
    with pytest.raises(UsageError, match=reason):
        link_options(asked, tls, "board")


@pytest.mark.parametrize(
    ("options", "backend", "reason"),
    [
        (
            {"real_time": True, "hold": 3},
            "native",
            "^--real-time, --hold: for --backend board, not native; cure: leave it out$",
        ),
        ({"fault": ["cut@1"]}, "replay", "^--fault: for --backend board, not replay"),
        ({"replay": Path("x")}, "board", "--replay is for --backend replay, not board"),
        ({"fault": ["nonsense"]}, "board", "unknown kind of fault 'nonsense'"),
        (
            {"hold": 3},
            "board",
            "^--hold 3 applies only to --real-time: simulated time waits for the board; cure: "
            "leave it out, or give --real-time$",
        ),
        ({}, "replay", "name it, --replay FILE"),
    ],
)
def test_options_that_would_do_nothing_are_refused(
    options: dict[str, Any], backend: str, reason: str
) -> None:
    with pytest.raises(UsageError, match=reason):
        link_options(link(**options), Tls(), backend)


def test_a_file_is_not_overwritten_by_a_record(tmp_path: Path) -> None:
    path = tmp_path / "record"
    path.write_text("precious")
    with pytest.raises(UsageError, match="is there already; choose another file"):
        link_options(link(record=path), Tls(), "board")


def test_a_dangling_symlink_is_not_replaced_by_a_record(tmp_path: Path) -> None:
    path = tmp_path / "record"
    path.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="is there already; choose another file"):
        link_options(link(record=path), Tls(), "board")
    assert path.is_symlink()


def test_a_replay_of_a_file_that_is_missing_or_not_a_record_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "record"
    with pytest.raises(UsageError, match="no such file"):
        link_options(link(replay=path), Tls(), "replay")
    path.write_text("no record")
    with pytest.raises(UsageError, match="no record of a board's session"):
        link_options(link(replay=path), Tls(), "replay")


def test_tls_with_fewer_than_three_files_is_refused() -> None:
    with pytest.raises(UsageError, match="three files: --cert, --key and --ca"):
        certificates(Tls(cert=Path("c")))
