"""A network on a stub is equal to native; options that do not go together are refused."""

from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport import Simulator
from spikeport.backends.board.address import Certificates
from spikeport.backends.board.link import LinkOptions
from spikeport.errors import BackendError, BoardLostError, UsageError

SECONDS = 0.05
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
def test_a_run_on_the_stub_is_native_and_so_is_its_record(
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
        ("board", {"board": "x"}, UsageError, "write unix:PATH or tcp://HOST:PORT"),
        ("board", {"board": "unix:/nowhere/x"}, BackendError, "no connection"),
        ("board", {"board": "unix:/x", "faults": ("cut@1",)}, UsageError, "is for the stub"),
        ("board", {"certificates": FILES}, UsageError, "are for a board at the end of tcp"),
        ("board", {"record": Path("/dev/null/x")}, UsageError, "--record /dev/null/x: File exists"),
        ("replay", {}, UsageError, "name it, --replay FILE"),
        ("replay", {"replay": Path("/nowhere/x")}, BackendError, "/nowhere/x: no such file"),
    ],
)
def test_links_that_are_none_are_refused(
    network: tuple[nengo.Network, list[nengo.Probe]],
    backend: str,
    link: dict[str, object],
    error: type[Exception],
    reason: str,
) -> None:
    with pytest.raises(error, match=reason):
        data(*network, backend, **link)
