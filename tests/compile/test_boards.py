"""Results of a network on several chips of a board, and the messages between its chips."""

from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport.compile.check.violation import DoesNotFitError
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.topology import chips_used, messages_between_chips
from spikeport.simulator import Simulator
from tests.helpers.chip_files import chip_file

N_STEPS = 200
CORE = {"compartments": 40, "in_axons": 256, "out_axons": 256, "synapse_bits": 2**16}


def loop() -> tuple[nengo.Network, nengo.Probe]:
    """Return two decoded ensembles in a loop with each other, and one that is wired to itself."""
    with nengo.Network(label="loop", seed=2) as network:
        source = nengo.Node(lambda t: np.sin(20 * t), label="source")
        a, b = (nengo.Ensemble(60, 1, label=label) for label in "ab")
        c = nengo.Ensemble(70, 1, label="c")
        nengo.Connection(source, a)
        nengo.Connection(a, b)
        nengo.Connection(b, a, transform=0.3)
        weights = 1e-4 * np.random.RandomState(0).randn(70, 70)
        nengo.Connection(c.neurons, c.neurons, transform=weights)
        nengo.Connection(b, c)
        probe = nengo.Probe(c, synapse=0.01)
    return network, probe


def board(folder: Path, cores: int, n_chips: int) -> Path:
    """Write a board with small cores, ``cores`` on each chip, and return its path."""
    return chip_file(folder / "board.toml", **CORE, cores=cores, chips=n_chips)


@pytest.fixture
def run():
    def run(chip: Path | str):
        network, probe = loop()
        with Simulator(network, chip=str(chip)) as simulator:
            simulator.run_steps(N_STEPS)
            return simulator.data[probe], simulator.activity, simulator.report()

    return run


def test_a_network_on_three_chips_computes_what_it_does_on_one(run, tmp_path: Path) -> None:
    path = board(tmp_path, cores=3, n_chips=4)
    (data, activity, report), (on_one, one, _) = run(path), run("loihi")
    np.testing.assert_array_equal(data, on_one)
    assert activity.totals()["spikes"] == one.totals()["spikes"] > 0
    assert len(activity.cores) == 7
    assert report["resources"]["cores"]["limit"] == 12
    assert report["resources"]["chips"] == {"used": 3, "limit": 4}


def test_the_report_counts_the_messages_between_chips_of_a_run(run, tmp_path: Path) -> None:
    path = board(tmp_path, cores=3, n_chips=4)
    _, activity, report = run(path)
    crossed = messages_between_chips(activity.messages, chips.get(str(path))).sum()
    terms = {term["event"]: term["count"] for term in report["energy"]["nahuku-fit"]["terms"]}
    assert 0 < terms["message_between_chips"] == crossed < activity.messages.sum()
    assert "message_between_chips" in report["timing"]["nahuku-fit"]["missing"]
    assert report["timing"]["nahuku-fit"]["between_chips"] is None


def test_a_board_with_too_few_chips_is_refused(run, tmp_path: Path) -> None:
    with pytest.raises(DoesNotFitError) as raised:
        run(board(tmp_path, cores=3, n_chips=2))
    assert [(v.id, v.used, v.limit) for v in raised.value.violations] == [
        ("SP201", "at least 7", "6")
    ]


def test_chips_used_is_the_number_of_chips_needed_for_the_cores(tmp_path: Path) -> None:
    chip = chips.get(str(board(tmp_path, cores=3, n_chips=4)))
    assert [chips_used(n, chip) for n in (1, 3, 4, 12)] == [1, 1, 2, 4]
