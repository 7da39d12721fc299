"""A link as a user asks for it: which board, by which clock, recorded or not."""

from dataclasses import dataclass
from pathlib import Path

from spikeport.backends.board.address import Address, Certificates, connect
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.line import SocketLine
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.stub import Stub
from spikeport.backends.board.timing import RealTime, SimulatedTime
from spikeport.backends.replay import ReplayChip
from spikeport.backends.step_log import LogOptions
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import UsageError

STUB = "stub"


@dataclass(frozen=True)
class LinkOptions:
    """The link to a board.

    Attributes
    ----------
    board : str
        ``"stub"`` starts a server and ends it; else ``unix:PATH`` or ``tcp://HOST:PORT``.
    real_time : bool
        True if steps keep to the clock of this machine, rather than wait for the board.
    hold : int
        In real time, the steps for which outputs are held while the board is late.
    faults : tuple of str
        A plan of faults for the stub, see `spikeport.backends.board.faults`.
    record : Path, optional
        A file to record the session in.
    replay : Path, optional
        A record that the backend ``replay`` plays back.
    certificates : Certificates, optional
        Files of TLS.
    """

    board: str = STUB
    real_time: bool = False
    hold: int = 5
    faults: tuple[str, ...] = ()
    record: Path | None = None
    replay: Path | None = None
    certificates: Certificates | None = None


OWN_STUB = LinkOptions()
"""The link where none is asked for: a stub, in simulated time."""


class _StubLine(SocketLine):
    """A line to a board of one's own, which ends with it."""

    def __init__(self, stub: Stub) -> None:
        super().__init__(connect(stub.address), "the board")
        self._stub = stub

    def close(self) -> None:
        """Hang up, and wait for the board's end."""
        super().close()
        self._stub.close()


def on_board(image: ChipImage, seed: int, log: LogOptions, link: LinkOptions) -> BoardChip:
    """Return an image on a board.

    Raises
    ------
    UsageError
        If the link's options do not go together, or the record's file cannot be written.
    BackendError
        If the board cannot be reached, or refuses.
    """
    if link.faults and link.board != STUB:
        raise UsageError("--fault is for the stub: a board has faults of its own")
    timing = RealTime(image.manifest.dt_s, link.hold) if link.real_time else SimulatedTime()
    recorder = None if link.record is None else _recorder(link.record)
    line = _line(link)
    try:
        return BoardChip(image, seed, line, timing, log, recorder)
    except BaseException:
        line.close()
        raise


def _recorder(path: Path) -> SessionRecorder:
    try:
        return SessionRecorder(path)
    except OSError as error:
        raise UsageError(f"--record {path}: {error.strerror}") from None


def _line(link: LinkOptions) -> SocketLine:
    if link.board == STUB:
        # A process of its own, which has to end with its host, at an interrupt too.
        stub = Stub(link.faults)
        try:
            return _StubLine(stub)
        except BaseException:
            stub.close()
            raise
    address = Address.parse(link.board)
    return SocketLine(connect(address, link.certificates), f"board {address}")


def replayed(image: ChipImage, _seed: int, log: LogOptions, link: LinkOptions) -> ReplayChip:
    """Return the record of an image, to be played back; UsageError if none is named."""
    return ReplayChip(image, record_of(link), log)


def record_of(link: LinkOptions) -> Path:
    """Return the record that is played back; UsageError if none is named."""
    if link.replay is None:
        raise UsageError("backend 'replay' plays a record back: name it, --replay FILE")
    return link.replay
