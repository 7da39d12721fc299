"""A board against the native chip, bit for bit, and the outcome of every fault."""

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from spikeport.backends.board.board import Board
from spikeport.backends.board.chip import BoardChip
from spikeport.backends.board.faults import FAULTS
from spikeport.backends.board.frame import Frame, Kind
from spikeport.backends.board.messages import BodyError, Codec, Totals
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.board.timing import WAITING, RealTime, SimulatedTime, Timing
from spikeport.backends.native.chip import NativeChip
from spikeport.backends.replay import ReplayChip
from spikeport.backends.step_log import KEPT_STEPS, LogOptions
from spikeport.errors import BackendError, BoardLostError
from tests.helpers.fake_board import MACHINE, FakeClock, FakeLine, small_image, spike_train

IMAGE = small_image()
REAL = RealTime(0.001)
STEPS = 200


def board_chip(
    faults: Sequence[str] = (), timing: Timing = REAL, recorder: SessionRecorder | None = None
) -> BoardChip:
    clock = FakeClock()
    line = FakeLine(Board(MACHINE), clock, faults)
    return BoardChip(IMAGE, 0, line, timing, recorder=recorder, clock=clock)


def equal_steps(chip: BoardChip, n: int = STEPS) -> int:
    """Return the number of steps that equal native's before one is held, or all are done."""
    native = NativeChip(IMAGE, 0)
    for number, spikes in enumerate(spike_train(n)):
        held = chip.figures.held
        outputs = chip.step(spikes, {})
        if chip.figures.held > held:
            return number
        for one, other in zip(outputs, native.step(spikes, {}), strict=True):
            np.testing.assert_array_equal(one, other)
    return n


def run(chip: BoardChip, n: int) -> None:
    for spikes in spike_train(n):
        chip.step(spikes, {})


@pytest.mark.parametrize("timing", [REAL, SimulatedTime()])
def test_a_board_equals_the_native_chip_bit_for_bit(timing: Timing) -> None:
    chip, native = board_chip(timing=timing), NativeChip(IMAGE, 0)
    assert equal_steps(chip) == STEPS
    for spikes in spike_train(STEPS):
        native.step(spikes, {})
    assert chip.activity().totals() == native.activity().totals()
    chip.close()
    assert chip.activity().totals() == native.activity().totals()
    assert chip.figures.skipped_spikes == chip.figures.asked_again == 0


def test_a_seed_may_be_an_integer_of_numpys() -> None:
    clock = FakeClock()
    line = FakeLine(Board(MACHINE), clock, [])
    chip = BoardChip(IMAGE, np.int64(7), line, REAL, clock=clock)  # type: ignore[arg-type]
    assert len(chip.step(spike_train(1)[0], {})) == len(IMAGE.manifest.outputs)


@pytest.mark.parametrize(
    "spikes",
    [np.ones(IMAGE.n_inputs, dtype=bool), np.array([0.5]), np.array([[0, 1]])],
    ids=["mask", "fractions", "two dimensions"],
)
def test_spikes_that_are_no_numbers_of_sources_are_refused_as_by_native(spikes: np.ndarray) -> None:
    chip = board_chip()
    with pytest.raises(BackendError) as by_native:
        NativeChip(IMAGE, 0).step(spikes, {})
    with pytest.raises(BackendError) as by_board:
        chip.step(spikes, {})
    assert str(by_board.value) == str(by_native.value)
    assert equal_steps(chip) == STEPS  # nothing was sent


@pytest.mark.parametrize(
    "fault",
    ["duplicate", "reorder", "flip", "garbage", "wrong-step", "wrong-session", "loss"],
)
def test_a_spoilt_answer_is_asked_for_again(fault: str) -> None:
    chip = board_chip([f"{fault}@100"])
    assert equal_steps(chip) == STEPS
    assert chip.figures.held == 0
    assert chip.figures.asked_again == (0 if fault == "duplicate" else 1)


@pytest.mark.parametrize("seed", range(3))
def test_a_bad_link_loses_no_step_in_simulated_time(seed: int) -> None:
    kinds = ["loss", "duplicate", "reorder", "flip", "garbage", "wrong-step", "wrong-session"]
    clock = FakeClock()
    line = FakeLine(Board(MACHINE), clock, [f"{kind}:0.05" for kind in kinds], seed)
    chip = BoardChip(IMAGE, 0, line, SimulatedTime(), clock=clock)
    assert equal_steps(chip) == STEPS
    assert chip.figures.asked_again > 20


def test_outputs_are_held_until_a_late_answer_and_skipped_spikes_are_counted() -> None:
    chip = board_chip(["slow=2.5@101"])
    trains = spike_train(STEPS)
    outputs = [[array.copy() for array in chip.step(spikes, {})] for spikes in trains]
    assert chip.figures.held == 2
    for held in outputs[100:102]:
        for one, other in zip(held, outputs[99], strict=True):
            np.testing.assert_array_equal(one, other)
    assert chip.figures.skipped_spikes == len(trains[101]) + len(trains[102])
    taken = [len(spikes) for spikes in trains[:101] + trains[103:]]
    np.testing.assert_array_equal(chip.activity().host_spikes, taken)
    assert chip.activity().n_steps == STEPS - 2


def test_after_a_late_answer_the_board_goes_on_from_where_it_was() -> None:
    chip, native = board_chip(["slow=2.5@101"]), NativeChip(IMAGE, 0)
    trains = spike_train(STEPS)
    outputs = [[array.copy() for array in chip.step(spikes, {})] for spikes in trains]
    sent = trains[:101] + trains[103:]
    expected = [[array.copy() for array in native.step(spikes, {})] for spikes in sent]
    for held, wanted in zip(outputs[103:], expected[101:], strict=True):
        for one, other in zip(held, wanted, strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_source_that_spikes_twice_in_a_step_spikes_twice_on_the_board() -> None:
    chip, native = board_chip(), NativeChip(IMAGE, 0)
    for spikes in spike_train(STEPS):
        twice = np.concatenate([spikes, spikes[:1]])
        for one, other in zip(chip.step(twice, {}), native.step(twice, {}), strict=True):
            np.testing.assert_array_equal(one, other)
    assert chip.activity().totals() == native.activity().totals()


def test_simulated_time_waits_for_a_slow_board() -> None:
    chip = board_chip(["slow=4000@100"], SimulatedTime())
    assert equal_steps(chip) == STEPS
    assert chip.figures.held == 0


@pytest.mark.parametrize(
    ("fault", "step", "reason"),
    [
        (
            "cut@100",
            100,
            r"^step 100: the board: the link is gone \(it hung up\); "
            "the session is over, start the run again$",
        ),
        ("half-open@100", 105, "step 100: the board did not answer within 6 steps of 1 ms"),
        ("slow=900@100", 105, "step 100: the board did not answer within 6 steps of 1 ms"),
        ("restart@100", 100, "the board refuses: session .* the state of its neurons is gone"),
    ],
)
def test_a_board_that_is_gone_ends_the_session(fault: str, step: int, reason: str) -> None:
    chip = board_chip([fault])
    with pytest.raises(BoardLostError, match=reason):
        run(chip, STEPS)
    assert chip.figures.steps == step
    assert chip.figures.held == step - 100
    chip.close()


def test_in_simulated_time_a_silent_board_is_given_up() -> None:
    chip = board_chip(["half-open@5"], SimulatedTime(patience_s=10))
    with pytest.raises(BoardLostError, match="step 5: the board did not answer within 10 s"):
        run(chip, 10)


def test_a_board_without_the_image_gets_it_once() -> None:
    clock = FakeClock()
    board = Board(MACHINE)
    sent = []
    for _ in range(2):
        line = FakeLine(board, clock)
        answers = line.send
        line.send = lambda frame, answers=answers: (sent.append(frame.kind), answers(frame))  # type: ignore[method-assign]
        BoardChip(IMAGE, 0, line, clock=clock).close()
    assert [kind.name for kind in sent].count("IMAGE") == 1
    assert [kind.name for kind in sent].count("HELLO") == 2


def test_errors_and_sources_that_the_image_does_not_have_are_refused_before_they_are_sent() -> None:
    chip = board_chip()
    silence = np.zeros(0, dtype=int)
    with pytest.raises(BackendError, match=r"^synapse group 0 does not learn"):
        chip.step(silence, {0: np.zeros(1)})
    with pytest.raises(BackendError, match=r"^synapse group -1 does not learn"):
        chip.step(silence, {-1: np.zeros(1)})
    with pytest.raises(BackendError, match="sent 1 spikes of sources 5 to 5"):
        chip.step(np.array([5]), {})
    assert chip.figures.steps == 0
    assert equal_steps(chip) == STEPS


class Forgetful(FakeLine):
    """A line that loses the first ``lost`` of the board's answers with totals."""

    lost = 0

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame that is not lost."""
        frame = super().receive(within_s)
        if frame is None or frame.kind != Kind.TOTALS or not self.lost:
            return frame
        self.lost -= 1
        return None


def test_waiting_for_a_welcome_is_no_busy_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []

    class Silent(FakeLine):
        def send(self, frame: Frame) -> None:
            """Lose the frame."""

        def receive(self, within_s: float) -> Frame | None:
            waits.append(within_s)
            return super().receive(within_s)

    clock = FakeClock()
    with pytest.raises(BoardLostError, match="does not answer within 2400 s"):
        BoardChip(IMAGE, 0, Silent(Board(MACHINE), clock), clock=clock)
    assert waits == [2400.0]


def test_totals_that_are_lost_are_asked_for_again() -> None:
    clock = FakeClock()
    line = Forgetful(Board(MACHINE), clock)
    chip = BoardChip(IMAGE, 0, line, SimulatedTime(), clock=clock)
    run(chip, STEPS)
    line.lost = 1
    native = NativeChip(IMAGE, 0)
    for spikes in spike_train(STEPS):
        native.step(spikes, {})
    assert chip.activity().totals() == native.activity().totals()
    assert line.lost == 0


@pytest.mark.parametrize(("timing", "limit_s"), [(RealTime(0.001, 5), 0.006), (WAITING, 10.0)])
def test_a_step_waits_no_longer_for_totals_than_for_its_answer(
    monkeypatch: pytest.MonkeyPatch, timing: Timing, limit_s: float
) -> None:
    monkeypatch.setattr("spikeport.backends.step_log.KEPT_STEPS", 20)
    clock = FakeClock()
    line = Forgetful(Board(MACHINE), clock)
    chip = BoardChip(IMAGE, 0, line, timing, clock=clock)
    run(chip, 19)
    line.lost, begin_s = 10**6, clock.now()
    with pytest.raises(BoardLostError, match=f"^step 20: .* not answer within {limit_s:g} s"):
        run(chip, 1)
    assert clock.now() - begin_s < limit_s + 0.002
    lost_s = clock.now()
    chip.close()
    assert clock.now() == lost_s  # a lost board is not waited for again


def test_closing_closes_the_line_and_the_record_even_if_the_totals_are_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def damaged(*_arguments: object) -> Totals:
        raise BodyError("totals of 3 bytes")

    monkeypatch.setattr(Codec, "unpack_totals", damaged)
    closed, close = list[SessionRecorder](), SessionRecorder.close
    monkeypatch.setattr(SessionRecorder, "close", lambda self: (closed.append(self), close(self)))
    clock = FakeClock()
    line, recorder = FakeLine(Board(MACHINE), clock), SessionRecorder(tmp_path / "record")
    log = LogOptions(folder=tmp_path / "counts")
    chip = BoardChip(IMAGE, 0, line, REAL, log, recorder, clock)
    run(chip, 1)
    with pytest.raises(BackendError, match="the board sent totals of 3 bytes"):
        chip.close()
    assert line.closed
    assert closed == [recorder]


def test_a_closed_chip_does_not_step() -> None:
    chip = board_chip()
    chip.close()
    with pytest.raises(BackendError, match="closed"):
        chip.step(np.zeros(0, dtype=int), {})


def test_a_fork_does_not_step_its_parents_board(monkeypatch: pytest.MonkeyPatch) -> None:
    chip = board_chip()
    monkeypatch.setattr("os.getpid", lambda: -1)
    with pytest.raises(BackendError, match="a forked process has no board of its own"):
        chip.step(np.zeros(0, dtype=int), {})


def test_figures_of_the_link_count_steps_and_round_trips_and_are_ready_for_json() -> None:
    chip = board_chip(["loss@3"])
    equal_steps(chip, 10)
    link = chip.link
    assert link is not None
    assert json.loads(json.dumps(link)) == link
    assert link["runs"] == "native"
    assert link["real_time"] is True
    assert (link["steps"], link["asked_again"], link["held"]) == (10, 1, 0)
    trips = link["round_trip_us"]
    assert isinstance(trips, dict)
    assert trips["median"] == pytest.approx(50, rel=0.03)


@pytest.mark.parametrize(
    ("fault", "timing", "worst_us"),
    [
        ("slow=2.5@5", REAL, 2_500),
        ("loss@5", REAL, 333),
        ("slow=700@5", SimulatedTime(), 700_000),
        ("loss@5", SimulatedTime(), 500_000),
    ],
)
def test_a_round_trip_begins_with_the_first_request_of_a_step(
    fault: str, timing: Timing, worst_us: float
) -> None:
    chip = board_chip([fault], timing)
    run(chip, 20)
    assert chip.figures.asked_again > 0
    link = chip.link
    assert link is not None
    trips = link["round_trip_us"]
    assert isinstance(trips, dict)
    assert trips["worst"] == pytest.approx(worst_us, abs=100)


@pytest.mark.parametrize(
    ("fault", "warned"),
    [
        ("loss@5", []),
        ("loss@6", ["fault loss@6 was never reached: the run has 5 steps"]),
        ("cut@5", []),
        ("cut@6", ["fault cut@6 was never reached: the run has 5 steps"]),
    ],
)
def test_a_fault_that_was_never_reached_is_named(
    fault: str, warned: list[str], recwarn: pytest.WarningsRecorder
) -> None:
    clock = FakeClock()
    plan = [FAULTS.parse(fault)]
    line = FakeLine(Board(MACHINE), clock, (fault,))
    chip = BoardChip(small_image(), 0, line, clock=clock, faults=plan)
    with suppress(BoardLostError):
        for spikes in spike_train(5):
            chip.step(spikes, {})
    chip.close()
    assert [str(one.message) for one in recwarn] == warned


@pytest.mark.parametrize("faults", [(), ("slow=2.5@11", "loss@20")])
def test_a_record_plays_back_what_the_host_got(tmp_path: Path, faults: Sequence[str]) -> None:
    path = tmp_path / "record"
    chip = board_chip(faults, recorder=SessionRecorder(path))
    trains = spike_train(60)
    got = [[array.copy() for array in chip.step(spikes, {})] for spikes in trains]
    chip.close()
    replay = ReplayChip(IMAGE, 0, path)
    for spikes, wanted in zip(trains, got, strict=True):
        for one, other in zip(replay.step(spikes, {}), wanted, strict=True):
            np.testing.assert_array_equal(one, other)
    assert replay.activity().totals() == chip.activity().totals()
    np.testing.assert_array_equal(replay.activity().host_spikes, chip.activity().host_spikes)
    replay.close()


@pytest.mark.slow
def test_a_record_longer_than_the_log_keeps_its_counts(tmp_path: Path) -> None:
    path = tmp_path / "record"
    chip = board_chip(recorder=SessionRecorder(path))
    trains = spike_train(KEPT_STEPS + 100)
    for spikes in trains:
        chip.step(spikes, {})
    chip.close()
    replay = ReplayChip(IMAGE, 0, path)
    for spikes in trains:
        replay.step(spikes, {})
    assert replay.activity().totals() == chip.activity().totals()
    assert replay.activity().n_steps == len(trains)


def test_a_lost_board_is_not_asked_again() -> None:
    clock = FakeClock()
    chip = BoardChip(IMAGE, 0, FakeLine(Board(MACHINE), clock, ["half-open@5"]), REAL, clock=clock)
    with pytest.raises(BoardLostError, match="step 5: "):
        run(chip, 10)
    lost_s = clock.now()
    for ask in (lambda: chip.step(spike_train(1)[0], {}), chip.activity):
        with pytest.raises(BoardLostError, match="the session is over, since the board was lost"):
            ask()
    chip.close()
    assert clock.now() == lost_s


def test_a_forked_process_leaves_the_session_to_its_parent(monkeypatch: pytest.MonkeyPatch) -> None:
    chip = board_chip()
    with monkeypatch.context() as forked:
        forked.setattr("spikeport.backends.board.chip.os.getpid", lambda: 0)
        chip.close()
    assert equal_steps(chip) == STEPS
    chip.close()
