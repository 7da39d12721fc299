"""The link that a command's options ask for."""

from spikeport.backends.board.address import Certificates
from spikeport.backends.board.faults import FAULTS
from spikeport.backends.board.link import LinkOptions
from spikeport.commands.options import Link, Tls
from spikeport.errors import UsageError


def link_options(link: Link, tls: Tls, backend: str) -> LinkOptions:
    """Return the link of a run.

    Raises
    ------
    UsageError
        If an option is for another backend, a fault is none, or the record's file is there already.
    """
    asked = LinkOptions(
        board=link.board,
        real_time=link.real_time,
        hold=link.hold,
        faults=tuple(link.fault),
        record=link.record,
        replay=link.replay,
        certificates=certificates(tls),
    )
    _check_backend(asked, backend)
    for text in asked.faults:
        FAULTS.parse(text)
    if asked.record is not None and asked.record.exists():
        raise UsageError(f"--record {asked.record}: is there already; choose another file")
    return asked


def _check_backend(asked: LinkOptions, backend: str) -> None:
    """Refuse options that would do nothing."""
    if backend != "replay" and asked.replay is not None:
        raise UsageError(f"--replay is for --backend replay, not {backend}")
    without_replay = LinkOptions(replay=asked.replay)
    if backend != "board" and asked != without_replay:
        raise UsageError(
            "--board, --real-time, --hold, --fault, --record, --cert, --key and --ca are for "
            f"--backend board, not {backend}"
        )


def certificates(tls: Tls) -> Certificates | None:
    """Return the files of TLS; None if there are none, UsageError if some are missing."""
    if tls.cert is None and tls.key is None and tls.ca is None:
        return None
    if tls.cert is None or tls.key is None or tls.ca is None:
        raise UsageError("TLS takes three files: --cert, --key and --ca")
    return Certificates(tls.cert, tls.key, tls.ca)
