"""The opening of a link, with the chip at its other end."""

from contextlib import ExitStack
from pathlib import Path

from spikeport.backends.board.address import FORMS, Address
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.faults import FAULTS
from spikeport.backends.board.line import SocketLine
from spikeport.backends.board.link import OWN_STUB, STUB, LinkOptions
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.sockets import client_context, connect
from spikeport.backends.board.stub import Stub
from spikeport.backends.board.timing import RealTime, SimulatedTime
from spikeport.backends.step_log import LogOptions
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BoardLostError, UsageError


class _StubLine(SocketLine):
    """A line to a stub, which ends with the line."""

    def __init__(self, stub: Stub) -> None:
        super().__init__(connect(stub.address), "the board")
        self._stub = stub

    def close(self) -> None:
        """Hang up, and wait until the stub has ended."""
        super().close()
        self._stub.close()


def check(link: LinkOptions) -> None:
    """Check a link's options before there is a board, or an image for it.

    Raises
    ------
    UsageError
        If options exclude each other, or one is wrong.
    """
    for text in link.faults:
        FAULTS.parse(text)
    if link.hold != OWN_STUB.hold and not link.real_time:
        raise UsageError(
            f"--hold {link.hold} applies only to --real-time: simulated time waits for the board; "
            "cure: leave it out, or give --real-time"
        )
    if link.board != STUB:
        if link.faults:
            raise UsageError("--fault works only with the stub, not with a board")
        client_context(Address.parse(link.board, f"{STUB}, {FORMS}"), link.certificates)
    elif link.certificates is not None:
        raise UsageError("--cert, --key and --ca work only with a board at tcp://HOST:PORT")


def on_board(image: ChipImage, seed: int, log: LogOptions, link: LinkOptions) -> BoardChip:
    """Return an image on a board.

    Raises
    ------
    UsageError
        If the link's options exclude each other, or the record's file cannot be written.
    BackendError
        If the board cannot be reached, or refuses.
    """
    check(link)
    timing = RealTime(image.manifest.dt_s, link.hold) if link.real_time else SimulatedTime()
    with ExitStack() as undo:
        line = _line(link)
        undo.callback(line.close)
        recorder = None
        if link.record is not None:
            recorder = recorder_at(link.record)
            # An empty record would be in the way of the next try.
            undo.callback(recorder.discard)
        try:
            faults = [FAULTS.parse(text) for text in link.faults]
            chip = BoardChip(image, seed, line, timing, log, recorder, faults=faults)
        except BoardLostError as error:
            if not (line.is_gone and link.board.startswith("tcp:")):
                raise
            raise _hung_up(error, link) from None
        undo.pop_all()
        return chip


def _hung_up(error: BoardLostError, link: LinkOptions) -> BoardLostError:
    """Return the error of a board that hung up before a session began, with a cure."""
    # A board hangs up on a host whose TLS it refuses: with TLS 1.3, after the host's handshake.
    cure = (
        "if it serves with --cert, --key and --ca, give them here, too"
        if link.certificates is None
        else f"its --ca must be the authority that signed {link.certificates.certificate}"
    )
    return BoardLostError(f"{error} before a session began; {cure}")


def recorder_at(path: Path) -> SessionRecorder:
    """Make the folder of a file, and return its recorder; UsageError if that fails."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return SessionRecorder(path)
    except OSError as error:
        raise UsageError(f"--record {path}: {error.strerror}; choose another file") from None


def _line(link: LinkOptions) -> SocketLine:
    if link.board == STUB:
        # The stub is a process that has to end with its host, also after an interrupt.
        stub = Stub(link.faults)
        try:
            return _StubLine(stub)
        except BaseException:
            stub.close()
            raise
    address = Address.parse(link.board)
    return SocketLine(connect(address, link.certificates), f"board {address}")
