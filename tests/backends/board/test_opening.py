"""Networks on a stub against the native backend, and refusals of options."""

from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.backends.board import opening
from spikeport.backends.board.address import Certificates
from spikeport.backends.board.frame import Frame
from spikeport.backends.board.link import STUB, LinkOptions
from spikeport.backends.board.record import SessionRecorder
from spikeport.backends.step_log import SUMS_ONLY
from spikeport.errors import BackendError, BoardLostError, UsageError
from tests.helpers.fake_board import small_image

SECONDS = 0.05
TEXTS = "expected a sequence of texts; cure: leave it out, or faults=('cut@20',)"
FILES = Certificates(Path("c"), Path("k"), Path("a"))


@pytest.fixture(scope="module")
def network() -> tuple[nengo.Network, list[nengo.Probe]]:
    """Return a network that learns, with probes of spikes, voltages and decoded values."""
    with nengo.Network(seed=1) as made:
        source = nengo.Node(lambda t: np.sin(40 * t))
        a, b = nengo.Ensemble(30, 1), nengo.Ensemble(20, 1)
        error = nengo.Node(size_in=1)
        nengo.Connection(source, a)
        learned = nengo.Connection(a, b, function=lambda x: 0.0, learning_rule_type=nengo.PES())
        nengo.Connection(b, error)
        nengo.Connection(source, error, transform=-1)
        nengo.Connection(error, learned.learning_rule)
        probes = [nengo.Probe(b), nengo.Probe(a.neurons), nengo.Probe(b.neurons, "voltage")]
    return made, probes


def data(network: nengo.Network, probes: list[nengo.Probe], backend: str, **link: object) -> list:
    with Simulator(network, backend=backend, link=LinkOptions(**link)) as sim:
        sim.run(SECONDS)
        return [*(sim.data[probe] for probe in probes), sim.activity.totals()]


@pytest.mark.slow
def test_a_run_on_the_stub_and_its_replay_equal_a_native_run(
    network: tuple[nengo.Network, list[nengo.Probe]], tmp_path: Path
) -> None:
    record = tmp_path / "record"
    expected = data(*network, "native")
    for found in (
        data(*network, "board", record=record),
        data(*network, "replay", replay=record),
    ):
        for one, other in zip(found[:-1], expected[:-1], strict=True):
            np.testing.assert_array_equal(one, other)
        assert found[-1] == expected[-1]


@pytest.mark.slow
def test_a_stub_that_is_cut_ends_the_run(
    network: tuple[nengo.Network, list[nengo.Probe]],
) -> None:
    with pytest.raises(BoardLostError, match="the board: the link is gone"):
        data(*network, "board", faults=("cut@20",))


@pytest.mark.parametrize(
    ("backend", "link", "error", "reason"),
    [
        ("board", {"board": "x"}, UsageError, "write stub, unix:PATH or tcp://HOST:PORT"),
        ("board", {"board": "unix:/nowhere/x"}, BackendError, "no connection"),
        (
            "board",
            {"board": "unix:/x", "faults": ("cut@1",)},
            UsageError,
            "^--fault works only with the stub, not with a board$",
        ),
        ("board", {"faults": ("nonsense@1",)}, UsageError, "'nonsense@1': unknown kind of fault"),
        (
            "board",
            {"hold": 0},
            UsageError,
            "^--hold 0 applies only to --real-time: simulated time waits for the board; cure: "
            "leave it out, or give --real-time$",
        ),
        (
            "board",
            {"certificates": FILES},
            UsageError,
            "^--cert, --key and --ca work only with a board at tcp://HOST:PORT$",
        ),
        ("board", {"record": Path("/dev/null/x")}, UsageError, "--record /dev/null/x: File exists"),
        ("replay", {}, UsageError, "name it, --replay FILE"),
        ("replay", {"replay": Path("/nowhere/x")}, UsageError, "/nowhere/x: no such file"),
        ("replay", {"replay": "/nowhere/x"}, UsageError, "/nowhere/x: no such file"),
    ],
)
def test_links_that_cannot_be_opened_are_refused(
    network: tuple[nengo.Network, list[nengo.Probe]],
    backend: str,
    link: dict[str, object],
    error: type[Exception],
    reason: str,
) -> None:
    with pytest.raises(error, match=reason):
        data(*network, backend, **link)


def test_paths_may_be_given_as_texts() -> None:
    assert LinkOptions(record="a", replay="b") == LinkOptions(record=Path("a"), replay=Path("b"))


@pytest.mark.parametrize(
    ("link", "reason"),
    [
        ({"faults": None}, f"faults=None: {TEXTS}"),
        ({"faults": (1,)}, f"faults=(1,): {TEXTS}"),
        (
            {"certificates": "c.pem"},
            "certificates='c.pem': expected Certificates; cure: Certificates(certificate, key, "
            "authority) of spikeport.backends.board.address",
        ),
        ({"hold": np.float64(2.5)}, "hold=2.5: input should be a valid integer"),
        (
            {"faults": "loss:0.1"},
            "faults='loss:0.1': is one text, expected a sequence of texts; cure: "
            "faults=('loss:0.1',)",
        ),
        ({"record": 3}, "record=3: expected a path; cure: name a file"),
        ({"record": "a\0b"}, r"record='a\x00b': expected a path; cure: name a file"),
        ({"hold": "5"}, "hold=5: input should be a valid integer"),
        ({"hold": -1}, "hold=-1: must be 0 or more"),
        ({"board": Path("x")}, "board=x: input should be a valid string"),
    ],
)
def test_options_of_another_type_are_refused(link: dict[str, object], reason: str) -> None:
    with pytest.raises(UsageError) as caught:
        LinkOptions(**link)
    assert str(caught.value) == f"LinkOptions: {reason}"


class GoneLine:
    """A line to a board that hung up."""

    is_gone, closed = True, False

    def send(self, _frame: Frame) -> None:
        raise BoardLostError("the board: the link is gone")

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize(
    ("board", "reason"),
    [(STUB, "gone"), ("tcp://127.0.0.1:80", r"gone before a session began; if it serves with --c")],
)
def test_a_session_that_does_not_begin_leaves_nothing_open_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, board: str, reason: str
) -> None:
    line, closed = GoneLine(), []
    close = SessionRecorder.close
    monkeypatch.setattr(SessionRecorder, "close", lambda self: closed.append(close(self)))
    monkeypatch.setattr(opening, "_line", lambda _link: line)
    link = LinkOptions(board=board, record=tmp_path / "record")
    with pytest.raises(BoardLostError, match=f"^the board: the link is {reason}"):
        opening.on_board(small_image(), 0, SUMS_ONLY, link)
    assert line.closed
    assert len(closed) == 1
    assert list(tmp_path.iterdir()) == []
