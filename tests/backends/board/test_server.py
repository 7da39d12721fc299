"""A server in a thread, for one host at a time, over every transport."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.board.address import Address, Certificates
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.faults import FAULTS
from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.line import SocketLine
from spikeport.backends.board.link import LinkOptions
from spikeport.backends.board.opening import on_board
from spikeport.backends.board.server import Service, serve
from spikeport.backends.board.sockets import connect
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.step_log import SUMS_ONLY
from spikeport.errors import BackendError, BoardLostError
from spikeport.fault_plan import Fault
from tests.helpers.certificates import certificates
from tests.helpers.fake_board import MACHINE, small_image, spike_train

IMAGE = small_image()
WAIT_S = 20.0


@contextmanager
def served(
    address: str,
    tls: Certificates | None = None,
    faults: Sequence[Fault] = (),
    once: bool = False,
) -> Iterator[list[str]]:
    """Serve until no host is there for a moment, and yield the lines that the server prints."""
    listens, printed = threading.Event(), []

    def say(line: str) -> None:
        printed.append(line)
        listens.set()

    service = Service(
        address=Address.parse(address),
        machine=MACHINE,
        certificates=tls,
        faults=faults,
        once=once,
        idle_s=1.0,
    )
    thread = threading.Thread(target=serve, args=(service, say), daemon=True)
    thread.start()
    assert listens.wait(WAIT_S)
    yield printed
    thread.join(WAIT_S)
    assert not thread.is_alive()


def wait_for(printed: list[str], text: str) -> None:
    """Wait until a server has printed a text."""
    end_s = time.monotonic() + WAIT_S
    while not any(text in line for line in printed):
        assert time.monotonic() < end_s, f"never printed: {text}"
        time.sleep(0.01)


def address_of(printed: list[str]) -> str:
    """Return the address that a native board printed; the system chooses port 0's."""
    return printed[0].removeprefix("board: native on ")


def line_to(address: str, tls: Certificates | None = None) -> SocketLine:
    return SocketLine(connect(Address.parse(address), tls), "the board")


def check_equal(chip: BoardChip) -> None:
    native = NativeChip(IMAGE, 0)
    for spikes in spike_train(50):
        for one, other in zip(chip.step(spikes, {}), native.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.fixture(params=["unix", "tcp", "tls"])
def transport(
    request: pytest.FixtureRequest, tmp_path: Path
) -> tuple[str, Certificates | None, Certificates | None]:
    """Return address, and certificates of board and host that know each other."""
    if request.param == "unix":
        return f"unix:{tmp_path / 'board'}", None, None
    address = "tcp://127.0.0.1:0"
    if request.param == "tcp":
        return address, None, None
    board, host = certificates(tmp_path, "board"), certificates(tmp_path, "host")
    return (
        address,
        replace(board, authority=host.authority),
        replace(host, authority=board.authority),
    )


def test_a_session_over_any_transport_equals_the_native_chip(
    transport: tuple[str, Certificates | None, Certificates | None], tmp_path: Path
) -> None:
    address, of_board, of_host = transport
    with served(address, of_board) as printed:
        for _ in range(2):  # the second host finds the board at rest
            chip = BoardChip(IMAGE, 0, line_to(address_of(printed), of_host))
            check_equal(chip)
            chip.close()
    assert printed[0].startswith(f"board: native on {address.removesuffix('0')}")
    assert printed.count("board: session ended after 50 steps") == 2
    assert not any("gone" in line for line in printed)
    assert not (tmp_path / "board").exists()


def test_a_host_that_leaves_without_a_goodbye_is_reported_as_gone(tmp_path: Path) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address) as printed:
        line = line_to(address)
        check_equal(BoardChip(IMAGE, 0, line))
        line.close()
    assert printed[-1] == "board: the host is gone after step 50"


def test_a_fault_that_was_never_reached_is_named(tmp_path: Path) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address, faults=[FAULTS.parse("loss@50"), FAULTS.parse("cut@51")]) as printed:
        chip = BoardChip(IMAGE, 0, line_to(address))
        check_equal(chip)
        chip.close()
    assert printed[-1] == "board: fault cut@51 was never reached: the run has 50 steps"
    assert not any("loss" in line for line in printed)


def test_a_second_host_is_refused_while_the_first_goes_on(tmp_path: Path) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address):
        first = BoardChip(IMAGE, 0, line_to(address))
        second = line_to(address)
        with pytest.raises(BoardLostError, match="in use by another host; one at a time"):
            BoardChip(IMAGE, 0, second)
        second.close()
        check_equal(first)
        first.close()


def test_a_second_host_that_sends_nothing_delays_no_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spikeport.backends.board.server.GREETING_S", WAIT_S)
    address = f"unix:{tmp_path / 'board'}"
    with served(address):
        first = BoardChip(IMAGE, 0, line_to(address))
        stranger = line_to(address)
        assert stranger.receive(0.5) is None  # the board waits for its greeting
        check_equal(first)  # a step that waited as well would be asked for again
        assert first.figures.asked_again == 0
        stranger.close()
        first.close()


def test_errors_of_tls_are_reported_at_both_ends(tmp_path: Path) -> None:
    address = "tcp://127.0.0.1:0"
    board, host = certificates(tmp_path, "board"), certificates(tmp_path, "host")
    cases = (
        (
            None,
            "the link is gone .*; if it serves with --cert, --key and --ca, give them here, too",
        ),
        (replace(host, authority=board.authority), f"its --ca .* that signed {host.certificate}"),
        (host, f"its certificate is refused .*; it must be signed by --ca {host.authority}, name"),
    )
    with served(address, board) as printed:
        for files, reason in cases:
            options = LinkOptions(board=address_of(printed), certificates=files)
            with pytest.raises(BackendError, match=reason):
                on_board(IMAGE, 0, SUMS_ONLY, options)
    assert len(printed) == 4
    assert all("board: refused a host: the TLS handshake failed (" in line for line in printed[1:])
    with served(address) as printed:
        # A board without TLS answers at once: a handshake that timed out is another failure.
        failed = r"the TLS handshake failed \((?!.*timed out).*\)"
        reason = rf"{failed}; does it serve with --cert, --key and --ca\?"
        with pytest.raises(BackendError, match=reason):
            line_to(address_of(printed), host)
    first_bytes = (
        "board: the host's first bytes are not a frame; a host with --cert, --key and --ca needs "
        "a board that serves with these options, too"
    )
    assert first_bytes in "".join(printed)


def test_the_port_that_the_system_chose_is_printed() -> None:
    with served("tcp://127.0.0.1:0") as printed:
        assert not address_of(printed).endswith(":0")
        BoardChip(IMAGE, 0, line_to(address_of(printed))).close()


def test_a_step_without_a_greeting_is_refused(tmp_path: Path) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address):
        line = line_to(address)
        line.send(Frame(Kind.STEP, 7, 1))
        answer = line.receive(WAIT_S)
        assert answer is not None
        assert answer.kind == Kind.REFUSAL
        assert b"session 00000007 is not known" in answer.body
        line.close()


@pytest.mark.parametrize(
    "spoil",
    [
        lambda rng: rng.bytes(300),
        lambda rng: Frame(Kind.HELLO, body=b'{"digest": 5}').encode(),
        lambda rng: Frame(Kind.HELLO, version=9).encode(),
        lambda rng: Frame(Kind.IMAGE, step=0, body=rng.bytes(50)).encode(),
        lambda rng: Frame(99, body=b"x").encode() * 50,
    ],
)
def test_a_board_survives_whatever_a_host_sends(
    tmp_path: Path, spoil: Callable[[np.random.RandomState], bytes]
) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address) as printed:
        line = line_to(address)
        line.send_bytes(spoil(np.random.RandomState(0)))
        line.close()
        wait_for(printed, "gone")
        chip = BoardChip(IMAGE, 0, line_to(address))
        check_equal(chip)
        chip.close()


def test_the_board_hangs_up_on_a_host_that_sends_no_greeting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spikeport.backends.board.server.HELLO_S", 0.1)
    address = f"unix:{tmp_path / 'board'}"
    with served(address) as printed:
        silent = line_to(address)
        wait_for(printed, "gone")
        chip = BoardChip(IMAGE, 0, line_to(address))
        check_equal(chip)
        chip.close()
        silent.close()
    assert "board: the host sent no greeting within 0.1 s" in printed


def test_a_host_that_sends_frames_and_no_greeting_is_hung_up_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spikeport.backends.board.server.HELLO_S", 0.1)
    with served(f"unix:{tmp_path / 'board'}") as printed:
        line = line_to(f"unix:{tmp_path / 'board'}")
        line.send(Frame(Kind.ASK_TOTALS, 1))
        wait_for(printed, "the host is gone")
        line.close()
    assert "board: the host sent no greeting within 0.1 s" in printed


def test_a_board_for_one_session_waits_for_a_host_that_greets(tmp_path: Path) -> None:
    address = f"unix:{tmp_path / 'board'}"
    with served(address, once=True) as printed:
        line_to(address).close()  # like another server that tests if the socket is in use
        chip = BoardChip(IMAGE, 0, line_to(address))
        chip.close()
    assert printed[-1] == "board: session ended after 0 steps"
