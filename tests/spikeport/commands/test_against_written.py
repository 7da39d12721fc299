"""Hints if a rewritten network takes more cores, or loses more, than the network as written."""

import nengo
import pytest

from spikeport.commands.against_written import as_written, more_cores, more_loss
from spikeport.compile.pipeline import compile_network


def pair(n: int, **options: nengo.synapses.Synapse) -> nengo.Network:
    with nengo.Network(seed=1, label="pair") as network:
        pre, post = nengo.Ensemble(n, 1), nengo.Ensemble(n, 1)
        nengo.Connection(pre, post, **options)
        nengo.Probe(post)
    return network


@pytest.mark.slow
def test_more_cores_than_as_written_give_a_hint() -> None:
    """Weights from neuron to neuron, 400 x 400, take a core more than decoded values."""
    network = pair(400)
    written = as_written(network, "loihi", "compact")
    found = compile_network(network, pipeline="compact")
    (hint,) = more_cores(found, written)
    assert (hint.id, hint.used) == ("SP411", "2, as written 1")
    assert list(more_cores(written, found)) == []


@pytest.mark.parametrize(
    ("error", "written", "used"),
    [
        (0.2, 0.1, ["20 % off, as written 10 %"]),
        (0.106, 0.1, ["11 % off, as written 10 %"]),
        (0.1049, 0.1, []),
        (0.1, 0.0, ["10 % off, as written 0 %"]),
        (0.1, 0.2, []),
        (None, 0.2, []),
        (0.1, None, []),
    ],
)
def test_more_loss_than_as_written_gives_a_hint(
    error: float | None, written: float | None, used: list[str]
) -> None:
    assert [hint.used for hint in more_loss(error, written)] == used


def test_as_written_is_none_without_rewriting_passes_for_failures_and_large_networks() -> None:
    assert as_written(pair(10), "loihi", "merge_axons,pack") is None
    assert as_written(pair(10, synapse=nengo.Alpha(0.01)), "loihi", "compact") is None
    with nengo.Network(seed=1) as many:
        for _ in range(301):
            nengo.Ensemble(1, 1)
    assert as_written(many, "loihi", "compact") is None
