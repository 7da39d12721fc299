"""`BoardChip`: an image on a board, at the other end of a link."""

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass

import numpy as np

from spikeport.backends.board.board import pieces
from spikeport.backends.board.frame import MORE, VERSION, Frame, Kind
from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.line import Line
from spikeport.backends.board.messages import BodyError, Codec
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.timing import WAITING, RealTime, StepDeadlines, Timing
from spikeport.backends.chip import CLOSED
from spikeport.backends.host_checks import HostChecks
from spikeport.backends.step_log import SUMS_ONLY, LogOptions, StepLog, Totals
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError, BoardLostError
from spikeport.fault_plan import Fault, unreached
from spikeport.hardware_models.activity import Activity
from spikeport.pacing import Clock, RoundTrips, SystemClock

WELCOME_S = 2400.0
"""Time that a board has to build a chip. Verilator, which takes minutes on a busy machine, is given
up by the board after 1,800 s."""
TOTALS_S = 30.0
"""Time that a board has for its totals, if no step waits for them."""


@dataclass
class LinkFigures:
    """The figures of a session.

    Attributes
    ----------
    steps : int
        Steps of the host.
    held : int
        Steps in which the last outputs were held, because the board's answer was late.
    skipped_spikes : int
        Spikes of steps that were never sent, because the board was still in an earlier step.
    asked_again, discarded : int
        Requests for a step that were repeated; frames that did not answer the step under way.
    damaged : int
        Times that bytes came that were not a frame.
    overruns : int
        Steps that began late, in real time; not those right behind a held step.
    """

    steps: int = 0
    held: int = 0
    skipped_spikes: int = 0
    asked_again: int = 0
    discarded: int = 0
    damaged: int = 0
    overruns: int = 0


class BoardChip:
    """An image on a board. Implements `spikeport.backends.chip.Chip`.

    Parameters
    ----------
    image : ChipImage
        The image to run; it is sent to the board if the board does not have it.
    seed : int
        Seed of the chip.
    line : Line
        The link.
    timing : SimulatedTime or RealTime
        The clock of the run.
    log : LogOptions
        See `spikeport.backends.step_log.StepLog`.
    recorder : SessionRecorder, optional
        A record of the session.
    clock : Clock, optional
        The clock that times are measured by.
    faults : sequence of Fault
        The plan of faults of the board's answers; closing warns of faults that were never reached.

    Attributes
    ----------
    figures : LinkFigures
        The figures of the session.
    welcome : Welcome
        The board's answer to the greeting: its machine and speed.

    Raises
    ------
    BackendError
        If the board refuses the image.
    BoardLostError
        If the board does not answer.
    """

    def __init__(
        self,
        image: ChipImage,
        seed: int,
        line: Line,
        timing: Timing = WAITING,
        log: LogOptions = SUMS_ONLY,
        recorder: SessionRecorder | None = None,
        clock: Clock | None = None,
        faults: Sequence[Fault] = (),
    ) -> None:
        self._clock = SystemClock() if clock is None else clock
        self._line, self._timing, self._recorder = line, timing, recorder
        self._codec, self._checks, self._faults = Codec(image), HostChecks(image), faults
        self._session = 0
        self.welcome = self._greeted(image, seed)
        self._deadlines = StepDeadlines(timing, self._clock)
        self._trips = RoundTrips()
        self.figures = LinkFigures()
        self._log = StepLog(image.cores, image.manifest.dt_s, self._asked_totals, log)
        self._totals: Totals | None = None
        self._totals_s = TOTALS_S
        self._held = self._codec.silence()
        self._open: Frame | None = None
        self._open_spikes = 0
        self._asked_s = self._ask_again_s = 0.0
        self._late = self._at = 0
        self._closed = self._lost = False
        self._process = os.getpid()

    def _greeted(self, image: ChipImage, seed: int) -> Welcome:
        """Open a session, and send the image if the board asks for it."""
        hello = Hello(image.digest, int(seed))  # JSON knows no integers of NumPy's
        self._line.send(Frame(Kind.HELLO, body=hello.pack()))
        answer = self._answer(WELCOME_S, Kind.WELCOME, Kind.WANT_IMAGE)
        if answer.kind == Kind.WANT_IMAGE:
            for piece in pieces(Kind.IMAGE, image.to_bytes(), 0):
                self._line.send(piece)
            answer = self._answer(WELCOME_S, Kind.WELCOME)
        try:
            welcome = Welcome.unpack(answer.body)
        except BodyError as error:
            raise BackendError(f"the board sent a wrong {error}") from None
        if welcome.digest != image.digest:
            raise BackendError(
                f"the board runs image {welcome.digest[:12]}, not {image.digest[:12]}"
            )
        self._session = answer.session
        if self._recorder is not None:
            self._recorder.begin(hello, welcome)
        return welcome

    def _answer(self, within_s: float, *kinds: Kind, asked: Frame | None = None) -> Frame:
        """Return the next frame of some kinds; frames of other kinds are discarded.

        The request ``asked`` is sent again if no answer comes in half of the time, since either
        may be lost. It is sent once, as a slow board would answer each request.
        """
        begin = self._clock.now()
        end, half = begin + within_s, begin + within_s / 2
        while (now := self._clock.now()) < end:
            if asked is not None and now >= half:
                self._line.send(asked)
                asked = None
            frame = self._line.receive((end if asked is None else half) - now)
            if frame is None:
                continue
            self._check(frame)
            if frame.kind in kinds:
                return frame
        raise BoardLostError(f"the board does not answer within {within_s:g} s")

    def _check(self, frame: Frame) -> None:
        """Raise an error if the board refuses, or speaks another version of the link."""
        if frame.kind == Kind.REFUSAL and frame.session in (0, self._session):
            raise BoardLostError(f"the board refuses: {frame.body.decode(errors='replace')}")
        if frame.version != VERSION:
            raise BackendError(
                f"the board speaks version {frame.version} of the link, this spikeport {VERSION}"
            )

    def step(self, spikes: np.ndarray, errors: Mapping[int, np.ndarray]) -> list[np.ndarray]:
        """Advance by one step; see `spikeport.backends.chip.Chip.step`.

        Raises
        ------
        BoardLostError
            If the board hung up, refused, or was late for more steps than outputs are held. The
            state of its neurons is unknown: the session is never continued.
        BackendError
            If the chip is closed, the spikes are no numbers of sources, or the errors are not those
            of groups that learn.
        """
        if self._closed:
            raise BackendError(CLOSED)
        self._refuse_forked()
        self._refuse_lost()
        # Checked here: the board would end the session.
        sources = self._checks.checked(spikes, errors)
        body, flags = self._codec.pack_step(sources, errors)
        # After a held step, the host waited for the board until this one was due.
        end = self._deadlines.begin(waited=self._late > 0)
        self.figures.steps += 1
        number = self._at + 1
        with self._ending_if_lost():
            try:
                answer = self._exchanged(end, sources, body, flags)
            except BoardLostError as error:
                raise BoardLostError(
                    f"step {number}: {error}; the session is over, start the run again"
                ) from None
        if self._recorder is not None:
            self._recorder.step(self._at, flags, body, answer)
        return self._held

    @contextmanager
    def _ending_if_lost(self) -> Iterator[None]:
        """Let an error of the board or the link end the session: nobody waits for it again."""
        try:
            yield
        except BackendError:
            self._lost = True
            raise

    def _refuse_forked(self) -> None:
        # Two processes on one socket would take each other's answers.
        if os.getpid() != self._process:
            raise BoardLostError(
                "a forked process has no board of its own: build the simulator in the process that "
                "runs it"
            )

    def _refuse_lost(self) -> None:
        if self._lost:
            raise BoardLostError(
                "the session is over, since the board was lost; start the run again"
            )

    def _exchanged(self, end: float, spikes: np.ndarray, body: bytes, flags: int) -> bytes | None:
        """Send a step, and return its answer; None if the last outputs are held."""
        if self._open is None:
            self._open = Frame(Kind.STEP, self._session, self._at + 1, body, flags)
            self._open_spikes = len(spikes)
            self._asked_s = self._clock.now()
            self._send_open()
        else:  # the board is behind, and spikes that it missed are never delivered late
            self.figures.skipped_spikes += len(spikes)
        answer = self._awaited(end)
        if answer is None:
            self._hold()
        return answer

    def _send_open(self) -> None:
        assert self._open is not None
        self._ask_again_s = self._clock.now() + self._timing.ask_again_s
        self._line.send(self._open)

    def _awaited(self, end: float) -> bytes | None:
        """Return the body of the answer to the step under way; None if it is late."""
        while (now := self._clock.now()) < end:
            if now >= self._ask_again_s:
                self.figures.asked_again += 1
                self._send_open()
            frame = self._line.receive(min(end, self._ask_again_s) - now)
            if frame is not None and self._taken(frame):
                return frame.body
        return None

    def _taken(self, frame: Frame) -> bool:
        """Take a frame if it answers the step under way, and return whether it does."""
        self._check(frame)
        # Late answers of earlier steps, and of sessions before a restart, are discarded.
        if (frame.kind, frame.session, frame.step) != (Kind.STATE, self._session, self._at + 1):
            self.figures.discarded += 1
            return False
        try:
            stepped = self._codec.unpack_state(frame.body)
        except BodyError as error:
            raise BackendError(f"step {frame.step}: the board sent {error}") from None
        self._trips.add(self._clock.now() - self._asked_s)
        self._held, self._open = stepped.held, None
        self._at, self._late = frame.step, 0
        # The log may ask for totals: a step does not wait longer for them than for its answer.
        self._totals_s = self._timing.patience_s
        try:
            self._log.append(stepped.counts, self._open_spikes)
        finally:
            self._totals_s = TOTALS_S
        return True

    def _hold(self) -> None:
        """Hold the last outputs for this step, or give the board up."""
        self._late += 1
        if self._late > self._timing.hold:
            raise BoardLostError(f"the board did not answer within {self._timing.limit}")
        self.figures.held += 1

    def _asked_totals(self) -> Totals:
        """Ask the board for its totals; after the session, return the last ones."""
        if self._totals is not None:
            return self._totals
        self._refuse_forked()
        self._refuse_lost()
        asked = Frame(Kind.ASK_TOTALS, self._session, self._at)
        with self._ending_if_lost():
            self._line.send(asked)
            body = b"".join(self._received_pieces(asked))
        if self._recorder is not None:
            self._recorder.totals(body)
        try:
            return self._codec.unpack_totals(body)
        except BodyError as error:
            raise BackendError(f"the board sent {error}") from None

    def _received_pieces(self, asked: Frame) -> Iterator[bytes]:
        at, more = 0, MORE
        while more:
            frame = self._answer(self._totals_s, Kind.TOTALS, asked=asked)
            if frame.step == at:  # any other frame is a piece that came twice
                yield frame.body
                at, more = at + len(frame.body), frame.flags & MORE

    def activity(self) -> Activity:
        """Return the counts; see `spikeport.backends.chip.Chip.activity`."""
        return self._log.activity()

    @property
    def link(self) -> dict[str, object] | None:
        """The figures of the session; round trips in us begin at the first request of a step."""
        figures = self.figures
        figures.damaged, figures.overruns = self._line.bad, self._deadlines.overruns
        return {
            "runs": self.welcome.runs,
            "real_time": isinstance(self._timing, RealTime),
            **asdict(figures),
            "round_trip_us": self._trips.summary_us(),
        }

    def close(self) -> None:
        """End the session; its counts stay readable. A forked process leaves it to its parent."""
        if self._closed or os.getpid() != self._process:
            return
        self._closed = True
        with ExitStack() as stack:
            # Last, as a user may have turned warnings into errors.
            stack.callback(self._warn_of_faults)
            # Also if the board sends wrong totals, for which the log asks as well.
            stack.callback(self._line.close)
            if self._recorder is not None:
                stack.callback(self._recorder.close)
            if not self._lost:
                with suppress(BackendError):  # the board may be lost by now
                    self._totals = self._asked_totals()
                    self._line.send(Frame(Kind.STOP, self._session, self._at))
            with suppress(BoardLostError):  # a lost board cannot report its messages any more
                self._log.close()

    def _warn_of_faults(self) -> None:
        # A step under way at the end of a session was asked for, so that its faults happened.
        for line in unreached(self._faults, self._at + (self._open is not None)):
            warnings.warn(line, stacklevel=2)
