"""A board: it takes an image, builds a chip from it, and answers one frame after the other.

It needs no socket, so that tests can step it by hand.
"""

import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from spikeport.backends.board.frame import MORE, MOST_BODY, VERSION, Frame, Kind
from spikeport.backends.board.hello import Hello, Welcome
from spikeport.backends.board.messages import BodyError, Codec
from spikeport.backends.chip import Chip
from spikeport.backends.step_log import StepLog
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError, SpikeportError, in_words, printable, reason_of
from spikeport.progress import say_nothing

IMAGE_BYTES = 256 << 20
"""Size of the largest image's file that a board takes."""
IMAGES_KEPT = 4
WARM_STEPS = 50
"""Steps of a chip that is then discarded: the first steps of a process are slow."""


class CountingChip(Chip, Protocol):
    """A chip that counts what happens on its cores."""

    @property
    def log(self) -> StepLog:
        """The counts of the chip's steps."""


class Machine(NamedTuple):
    """A kind of chip that a board may run: its name, and how an image is loaded with a seed."""

    name: str
    load: Callable[[ChipImage, int], CountingChip]


@dataclass
class Session:
    """A chip in use by one host; ``last`` is the answer to step ``at``."""

    number: int
    chip: CountingChip
    codec: Codec
    at: int = 0
    last: Frame | None = None


class Board:
    """A board without its link.

    Parameters
    ----------
    machine : Machine
        The chip that it runs.
    say : callable
        Is called with a line before a chip is warmed up.

    Attributes
    ----------
    session : Session or None
        The session under way.
    """

    def __init__(self, machine: Machine, say: Callable[[str], None] = say_nothing) -> None:
        self._machine, self._say = machine, say
        self._images: dict[str, ChipImage] = {}
        self.session: Session | None = None
        self._hello: Hello | None = None
        self._upload = bytearray()

    def answer(self, frame: Frame) -> Sequence[Frame]:
        """Return the answers to a frame; one that cannot be answered ends the session."""
        try:
            return self._answer(frame)
        except (BodyError, SpikeportError) as error:
            return [self._refusal(frame, str(error))]

    def _refusal(self, frame: Frame, reason: str) -> Frame:
        """End the session, and return the reason for the host."""
        number = 0 if self.session is None else self.session.number
        self.end()
        body = printable(reason, kept="\n").encode()  # a reason may have several lines
        return Frame(Kind.REFUSAL, number, frame.step, body)

    def _answer(self, frame: Frame) -> Sequence[Frame]:
        if frame.version != VERSION:
            raise BodyError(f"the host speaks version {frame.version} of the link, not {VERSION}")
        match frame.kind:
            case Kind.STEP:
                return [self._step(frame)]
            case Kind.HELLO:
                return [self._greet(Hello.unpack(frame.body))]
            case Kind.IMAGE:
                return self._receive(frame)
            case Kind.ASK_TOTALS:
                return list(pieces(Kind.TOTALS, self._totals(frame), frame.session))
            case Kind.STOP:
                self.end()
                return []
        raise BodyError(f"a host does not send frames of kind {frame.kind}")

    def end(self) -> None:
        """End the session: the state of its neurons is gone."""
        if self.session is not None:
            self.session.chip.close()
        self.session, self._hello = None, None
        self._upload.clear()

    def _greet(self, hello: Hello) -> Frame:
        self.end()
        self._hello = hello
        if hello.digest not in self._images:
            return Frame(Kind.WANT_IMAGE)
        return self._open(self._images[hello.digest], hello)

    def _receive(self, frame: Frame) -> Sequence[Frame]:
        """Take a piece of an image; after the last one, build it."""
        if self._hello is None:
            raise BodyError("the host sent an image that the board did not ask for")
        if frame.step != (at := len(self._upload)):
            raise BodyError(f"a piece of an image begins at byte {frame.step}, expected byte {at}")
        self._upload += frame.body
        if len(self._upload) > IMAGE_BYTES:
            raise BodyError(f"an image of more than {IMAGE_BYTES:,} bytes")
        if frame.flags & MORE:
            return []
        image = ChipImage.from_bytes(bytes(self._upload))
        if image.digest != self._hello.digest:
            raise BodyError(
                f"the image has the digest {image.digest[:12]}, HELLO has {self._hello.digest[:12]}"
            )
        while len(self._images) >= IMAGES_KEPT:
            # Remove the oldest image: dicts keep the order of insertion.
            del self._images[next(iter(self._images))]
        self._images[image.digest] = image
        return [self._open(image, self._hello)]

    def _open(self, image: ChipImage, hello: Hello) -> Frame:
        """Begin a session, with the chip at rest; return the answer when a step can come."""
        self._upload.clear()
        self._hello = None  # one greeting, one session: another image would replace its chip
        codec = Codec(image)  # before a chip that nobody would close, as its outputs may not fit
        # Warm up another chip, since the session's chip has to begin at rest. Lines that this chip
        # prints about its steps are not about the session.
        self._say(f"board: warm-up and check of the machine: {WARM_STEPS} steps without spikes")
        with _machine_errors():
            steps_per_s = _warm(self._machine.load(image, hello.seed))
            chip = self._machine.load(image, hello.seed)
        # Not guessable, and never 0, which stands for no session.
        number = secrets.randbelow(2**32 - 1) + 1
        self.session = Session(number, chip, codec)
        body = Welcome(image.digest, self._machine.name, steps_per_s).pack()
        return Frame(Kind.WELCOME, number, body=body)

    def _step(self, frame: Frame) -> Frame:
        """Step the chip; if the host asks for a step again, repeat the answer, not the step."""
        session = self._session_of(frame)
        # The answer was lost on its way: a second step would put the chip ahead of the host.
        if frame.step == session.at and session.last is not None:
            return session.last
        if frame.step != session.at + 1:
            raise BodyError(f"step {frame.step} after step {session.at}: some are missing")
        spikes, errors = session.codec.unpack_step(frame.body, frame.flags)
        begin = time.perf_counter_ns()
        with _machine_errors():
            held = session.chip.step(spikes, errors)
        # The field has 32 bits, which are 71 minutes.
        lasted_us = min((time.perf_counter_ns() - begin) // 1000, 2**32 - 1)
        body = session.codec.pack_state(held, session.chip.log.last)
        session.at = frame.step
        session.last = Frame(Kind.STATE, session.number, frame.step, body, lasted_us=int(lasted_us))
        return session.last

    def _session_of(self, frame: Frame) -> Session:
        """Return the session of a frame; a session from before a restart is never continued."""
        if frame.session == 0:
            raise BodyError(
                "the head has session 0; begin with HELLO, and send the number that the head of "
                "WELCOME has"
            )
        if self.session is None or frame.session != self.session.number:
            raise BodyError(
                f"session {frame.session:08x} is not known: it is over, or the board was started "
                "anew, and the state of its neurons is gone"
            )
        return self.session

    def _totals(self, frame: Frame) -> bytes:
        session = self._session_of(frame)
        # Not the activity, whose table of all kept steps takes longer than a step of real time.
        return session.codec.pack_totals(session.chip.log.totals())


@contextmanager
def _machine_errors() -> Iterator[None]:
    """Name the machine in errors from outside spikeport: of files, programs or packages."""
    try:
        yield
    except SpikeportError:
        raise
    except OSError as error:
        raise BackendError(f"the board's machine: {reason_of(error)}") from error
    except Exception as error:  # no error may end a board, which serves other hosts, too
        raise BackendError(f"the board's machine: {in_words(error)}") from error


def pieces(kind: Kind, data: bytes, session: int) -> Iterator[Frame]:
    """Yield the frames of a content that may be too large for one frame."""
    for start in range(0, max(1, len(data)), MOST_BODY):
        body = data[start : start + MOST_BODY]
        more = MORE if start + MOST_BODY < len(data) else 0
        yield Frame(kind, session, start, body, more)


def _warm(chip: CountingChip) -> float:
    """Step a chip, discard it, and return its steps per second."""
    silence = np.zeros(0, dtype=np.int64)
    with closing(chip):
        begin = time.perf_counter()
        for _ in range(WARM_STEPS):
            chip.step(silence, {})
        return WARM_STEPS / (time.perf_counter() - begin)
