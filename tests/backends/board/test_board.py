"""A board, stepped by hand: its steps, its sessions and the images it takes."""

import errno

import numpy as np
import pytest

from spikeport.backends.board.board import IMAGES_KEPT, Board, CountingChip, Machine, pieces
from spikeport.backends.board.frame import MORE, MOST_BODY, Frame, Kind
from spikeport.backends.board.hello import Hello
from spikeport.backends.board.messages import Codec
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.fake_board import MACHINE, small_image
from tests.helpers.images import Block, Output, Parts

IMAGE = small_image()
BODY, FLAGS = Codec(IMAGE).pack_step(np.array([1]), {})


def answers(board: Board, *frames: Frame) -> list[Frame]:
    return [answer for frame in frames for answer in board.answer(frame)]


@pytest.fixture
def board() -> Board:
    """Return a board in a session."""
    made = Board(MACHINE)
    found = answers(made, Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack()))
    assert [answer.kind for answer in found] == [Kind.WANT_IMAGE]
    found = answers(made, *pieces(Kind.IMAGE, IMAGE.to_bytes(), 0))
    assert [answer.kind for answer in found] == [Kind.WELCOME]
    return made


def step(board: Board, number: int) -> Frame:
    assert board.session is not None
    (answer,) = answers(board, Frame(Kind.STEP, board.session.number, number, BODY, FLAGS))
    return answer


def refusal(answer: Frame) -> str:
    assert answer.kind == Kind.REFUSAL
    return answer.body.decode()


def test_a_step_that_is_asked_for_again_is_answered_without_a_second_step(board: Board) -> None:
    first = step(board, 1)
    assert step(board, 1) is first
    assert board.session is not None
    assert board.session.chip.activity().n_steps == 1
    assert step(board, 2).step == 2


@pytest.mark.parametrize("number", [0, 2, 9])
def test_a_missing_step_ends_the_session(board: Board, number: int) -> None:
    assert refusal(step(board, number)) == f"step {number} after step 0: some are missing"
    assert board.session is None


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (Frame(Kind.STEP, 0, 1, BODY, FLAGS), "the head has session 0; begin with HELLO"),
        (Frame(Kind.STEP, 7, 1, BODY, FLAGS), "session 00000007 is not known: it is over, or"),
        (Frame(Kind.STATE), "a host does not send frames of kind 6"),
        (Frame(99), "a host does not send frames of kind 99"),
    ],
)
def test_a_frame_that_a_board_does_not_expect_ends_the_session(
    board: Board, frame: Frame, reason: str
) -> None:
    (answer,) = answers(board, frame)
    assert refusal(answer).startswith(reason)
    assert board.session is None


def test_a_new_greeting_begins_a_session_at_rest(board: Board) -> None:
    before = [step(board, number).body for number in (1, 2, 3)]
    (welcome,) = answers(board, Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack()))
    assert welcome.kind == Kind.WELCOME
    assert [step(board, number).body for number in (1, 2, 3)] == before


def test_an_image_other_than_the_greeting_named_is_refused(board: Board) -> None:
    other = Parts(inputs=[2]).image()
    answers(board, Frame(Kind.HELLO, body=Hello("0" * 64, 0).pack()))
    (answer,) = answers(board, *pieces(Kind.IMAGE, other.to_bytes(), 0))
    digest = other.digest[:12]
    assert refusal(answer) == f"the image has the digest {digest}, HELLO has 000000000000"


def test_pieces_of_an_image_must_follow_each_other() -> None:
    board = Board(MACHINE)
    answers(board, Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack()))
    (answer,) = answers(board, Frame(Kind.IMAGE, step=5, body=b"x", flags=MORE))
    assert refusal(answer) == "a piece of an image begins at byte 5, expected byte 0"


def test_the_board_keeps_the_last_images() -> None:
    board = Board(MACHINE)
    for n in range(IMAGES_KEPT + 1):
        image = Parts(inputs=[n + 1]).image()
        answers(board, Frame(Kind.HELLO, body=Hello(image.digest, 0).pack()))
        answers(board, *pieces(Kind.IMAGE, image.to_bytes(), 0))
    for n, kind in ((IMAGES_KEPT, Kind.WELCOME), (0, Kind.WANT_IMAGE)):
        digest = Parts(inputs=[n + 1]).image().digest
        (answer,) = answers(board, Frame(Kind.HELLO, body=Hello(digest, 0).pack()))
        assert answer.kind == kind


def test_a_large_content_is_sent_in_pieces() -> None:
    data = bytes(range(256)) * (MOST_BODY // 128) + b"end"
    frames = list(pieces(Kind.IMAGE, data, 0))
    assert [frame.flags for frame in frames] == [MORE, MORE, 0]
    assert b"".join(frame.body for frame in frames) == data


def test_bytes_that_are_not_an_image_are_refused(board: Board) -> None:
    answers(board, Frame(Kind.HELLO, body=Hello("0" * 64, 0).pack()))
    (answer,) = answers(board, Frame(Kind.IMAGE, body=b"no image"))
    assert refusal(answer) == "not a chip image, or truncated or altered"


def test_an_image_without_compartments_is_refused_and_the_board_goes_on(board: Board) -> None:
    empty = Parts(blocks=[]).image()
    answers(board, Frame(Kind.HELLO, body=Hello(empty.digest, 0).pack()))
    (answer,) = answers(board, *pieces(Kind.IMAGE, empty.to_bytes(), 0))
    assert refusal(answer) == "the number of blocks is 0, at least 1; compile it again"
    (welcome,) = answers(board, Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack()))
    assert welcome.kind == Kind.WELCOME


def test_no_chip_stays_open_for_an_image_whose_outputs_do_not_fit_a_frame() -> None:
    opened: list[NativeChip] = []

    def load(image: ChipImage, seed: int) -> NativeChip:
        opened.append(NativeChip(image, seed))
        return opened[-1]

    outputs = [Output("voltage", range(1000))] * 270
    image = Parts([Block(1000)], outputs=outputs).image()
    board = Board(Machine("native", load))
    board.answer(Frame(Kind.HELLO, body=Hello(image.digest, 0).pack()))
    for piece in pieces(Kind.IMAGE, image.to_bytes(), 0):
        (answer,) = board.answer(piece) or [None]
    assert answer is not None
    assert answer.kind == Kind.REFUSAL
    assert opened == []


def test_an_image_that_nobody_asked_for_ends_the_session(board: Board) -> None:
    assert board.session is not None
    chip = board.session.chip
    (answer,) = answers(board, *pieces(Kind.IMAGE, IMAGE.to_bytes(), 0))
    assert refusal(answer) == "the host sent an image that the board did not ask for"
    with pytest.raises(BackendError, match="the chip is closed"):
        chip.step(np.zeros(0, dtype=int), {})


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
        (KeyError("of another's package"), 'KeyError: "of another\'s package"'),
    ],
)
def test_a_machine_that_fails_ends_the_session_and_not_the_board(
    error: Exception, reason: str
) -> None:
    def broken(_image: ChipImage, _seed: int) -> CountingChip:
        raise error

    board = Board(Machine("broken", broken))
    greeting = Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack())
    found = answers(board, greeting, *pieces(Kind.IMAGE, IMAGE.to_bytes(), 0))
    assert refusal(found[-1]).startswith(f"the board's machine: {reason}")
    assert answers(board, greeting)[-1].kind == Kind.REFUSAL


def test_a_reason_keeps_its_lines_and_its_control_characters_are_escaped() -> None:
    def broken(_image: ChipImage, _seed: int) -> CountingChip:
        raise BackendError("the chip cannot hold it:\n  a: \x07")

    greeting = Frame(Kind.HELLO, body=Hello(IMAGE.digest, 0).pack())
    found = answers(
        Board(Machine("broken", broken)), greeting, *pieces(Kind.IMAGE, IMAGE.to_bytes(), 0)
    )
    assert refusal(found[-1]) == "the chip cannot hold it:\n  a: \\x07"


def test_a_chip_that_fails_in_a_step_ends_the_session_and_not_the_board(
    board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("lost")

    assert board.session is not None
    monkeypatch.setattr(board.session.chip, "step", broken)
    assert refusal(step(board, 1)).startswith("the board's machine: RuntimeError: lost")
    assert board.session is None
