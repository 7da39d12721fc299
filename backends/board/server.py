"""``spikeport board serve``: a process that acts as a board, for one host at a time."""

import select
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass

from spikeport.backends.board.address import Address, Certificates
from spikeport.backends.board.board import Board, Machine
from spikeport.backends.board.faults import FaultyLine
from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.line import SocketLine
from spikeport.backends.board.sockets import accepted, bound_text, listening, secured
from spikeport.counted import counted
from spikeport.errors import BoardLostError
from spikeport.fault_plan import Fault, unreached
from spikeport.pacing import SystemClock

LOOK_S = 0.5
"""Time between looks for other hosts, which are refused."""
HELLO_S = 10.0
"""Time in which a host must greet the board, which serves no other host meanwhile."""
GREETING_S = 1.0
"""Time in which a host that is refused must greet the board, to be answered."""
BUSY = b"it is in use by another host; one at a time"


@dataclass(frozen=True, kw_only=True)
class Service:
    """The settings of a server.

    Attributes
    ----------
    address : Address
        The address that it listens at.
    machine : Machine
        The chip that it runs.
    certificates : Certificates, optional
        Files of TLS; a host must show a certificate too.
    allow_remote : bool
        True if it may listen where other machines reach it.
    faults : sequence of Fault
        A plan of faults, which begins anew with each connection.
    once : bool
        End after the first session.
    idle_s : float, optional
        End after so long without a connection.
    """

    address: Address
    machine: Machine
    certificates: Certificates | None = None
    allow_remote: bool = False
    faults: Sequence[Fault] = ()
    once: bool = False
    idle_s: float | None = None


def serve(service: Service, say: Callable[[str], None]) -> None:
    """Serve until the process is ended, or as long as the settings say.

    Parameters
    ----------
    service : Service
        The settings.
    say : callable
        Prints a line.

    Raises
    ------
    UsageError
        If the board cannot listen at the address, or a certificate's file is wrong.
    """
    asked = service.address, service.certificates, service.allow_remote
    with listening(*asked) as (listener, context):
        say(f"board: {service.machine.name} on {bound_text(service.address, listener)}")
        _Server(service, listener, context, say).run()


class _Server:
    """A board that listens: it serves a host at a time, and refuses others meanwhile."""

    def __init__(
        self,
        service: Service,
        listener: socket.socket,
        context: ssl.SSLContext | None,
        say: Callable[[str], None],
    ) -> None:
        self._service, self._listener, self._context = service, listener, context
        self._say = say
        self._board = Board(service.machine, say)

    def run(self) -> None:
        """Serve one host after the other."""
        while select.select([self._listener], [], [], self._service.idle_s)[0]:
            connected = self._connected(accepted(self._listener))
            if connected is not None:
                greeted = self._serve(connected)
                if greeted and self._service.once:
                    return

    def _connected(self, plain: socket.socket | None) -> socket.socket | None:
        """Return a host's connection; None if it hung up, or TLS failed."""
        return None if plain is None else secured(plain, self._context, self._say)

    def _serve(self, connected: socket.socket) -> bool:
        """Serve a host until it goes, and return whether it greeted."""
        board, faults = self._board, self._service.faults
        with closing(SocketLine(connected, "the host")) as line:
            faulty = FaultyLine(line, faults, SystemClock(), board.end)
            send = faulty.send if faults else line.send
            greeted, ended, steps = False, False, 0
            try:
                for frame in self._frames(line):
                    greeted |= frame.kind == Kind.HELLO
                    if frame.kind == Kind.STOP:
                        ended, steps = True, _steps(board)  # `answer` ends the session
                    for answer in board.answer(frame):
                        send(answer)
                        if answer.kind != Kind.STATE:
                            self._report(answer)
                    if ended:
                        break
            except BoardLostError as error:
                self._say(f"board: {error}")
            finally:
                # Also if an interrupt ends the board: a real chip has to be shut down.
                steps = steps or _steps(board)
                board.end()
        for text in _ending(self._service, ended, steps):
            self._say(f"board: {text}")
        return greeted

    def _report(self, answer: Frame) -> None:
        """Print a line for an answer that begins a session, or refuses one."""
        if answer.kind == Kind.WELCOME:
            self._say(f"board: session {answer.session:08x}: {answer.body.decode()}")
        if answer.kind == Kind.REFUSAL:
            self._say(f"board: refused: {answer.body.decode()}")

    def _frames(self, line: SocketLine) -> Iterator[Frame]:
        """Yield the host's frames; every `LOOK_S`, refuse other hosts.

        Raises
        ------
        BoardLostError
            If the host hung up, does not begin with a frame, or does not greet within `HELLO_S`.
        """
        look_s, is_met, greeted, end_s = 0.0, False, False, time.perf_counter() + HELLO_S
        while True:
            frame = line.receive(LOOK_S)
            if frame is not None:
                is_met = True
                greeted |= frame.kind == Kind.HELLO
                yield frame
            elif line.bad and not is_met:  # such a host would wait long for an answer
                raise BoardLostError(
                    "the host's first bytes are not a frame; a host with --cert, --key and --ca "
                    "needs a board that serves with these options, too"
                )
            if not greeted and time.perf_counter() > end_s:
                raise BoardLostError(f"the host sent no greeting within {HELLO_S:g} s")
            if time.perf_counter() >= look_s:
                look_s = time.perf_counter() + LOOK_S
                self._refuse_others()

    def _refuse_others(self) -> None:
        """Refuse a host that waits, if any."""
        if select.select([self._listener], [], [], 0)[0]:
            other = accepted(self._listener)
            # In a thread: waiting for handshake and greeting must not hold up a step.
            threading.Thread(target=self._refuse, args=(other,), daemon=True).start()

    def _refuse(self, plain: socket.socket | None) -> None:
        """Refuse another host, with the reason."""
        connected = self._connected(plain)
        if connected is not None:
            with closing(SocketLine(connected, "another host")) as line:
                try:
                    line.receive(GREETING_S)  # unread bytes would reset the connection
                    line.send(Frame(Kind.REFUSAL, body=BUSY))
                except BoardLostError:
                    pass


def _ending(service: Service, ended: bool, steps: int) -> Iterator[str]:
    """Yield a line on how a session ended, and lines on faults that were never reached."""
    if ended:
        yield f"session ended after {counted(steps, 'step')}"
    else:
        yield f"the host is gone{f' after step {steps:,}' if steps else ''}"
    yield from unreached(service.faults, steps)


def _steps(board: Board) -> int:
    return 0 if board.session is None else board.session.at
