"""`SplitEnsembles`: large ensembles split into parts, with their connections and probes."""

import nengo
import numpy as np
import pytest

from spikeport.compile.check.lint import lint
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Piece, Rewrite
from spikeport.compile.passes.decode_path import DecodePath
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.split_ensembles import SplitEnsembles
from tests.helpers.random_networks import assert_equal_in_float, random_network, rewritten
from tests.helpers.same_run import context, small_chip


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))]
)
def test_split_ensembles_compute_the_same_in_float(seed: int) -> None:
    split = assert_equal_in_float(random_network(seed), SplitEnsembles(max_neurons=11))
    sizes = {e.n_neurons for e in split.network.all_ensembles}
    assert sizes == {6, 7, 8, 12}  # one of 12 stays, as all of its neurons are probed


def large(probe_neurons: slice = slice(0, 5)) -> nengo.Network:
    with nengo.Network(seed=2) as network:
        source = nengo.Ensemble(50, 2, label="source")
        large = nengo.Ensemble(100, 2, label="large")
        nengo.Connection(source, large[1], function=lambda x: x[0] * x[1])
        nengo.Connection(large, nengo.Node(lambda _t, x: x, size_in=2))
        nengo.Probe(large.neurons[probe_neurons])
    return network


def test_parts_have_no_more_neurons_than_a_core_has_input_axons() -> None:
    network, notes = large(), {}
    rewrite = Rewrite(network, Names(network))
    small = context(small_chip(in_axons=64), notes)
    split = SplitEnsembles().apply(rewrite, small)
    assert notes == {"parts": {"large": 2}}
    assert [split.names[e] for e in split.network.ensembles] == [
        "large[1/2]",
        "large[2/2]",
        "source",
    ]


def test_connections_to_slices_of_a_split_ensemble_reach_whole_parts() -> None:
    network = large()
    assert any(one.post_slice != slice(None) for one in network.connections)
    split, _ = rewritten(network, SplitEnsembles(max_neurons=64))
    assert all(one.post_slice == slice(None) for one in split.network.connections)
    assert not lint(split.scope)


def test_an_ensemble_probed_across_parts_stays_whole() -> None:
    split, notes = rewritten(large(slice(40, 60)), SplitEnsembles(max_neurons=64))
    assert notes == {"parts": {}}
    assert "large" in [e.label for e in split.network.ensembles]


def test_a_probe_that_ends_with_the_first_neuron_of_the_next_part_keeps_the_ensemble_whole() -> (
    None
):
    """The second part of 100 neurons starts at 50."""
    _, notes = rewritten(large(slice(40, 51)), SplitEnsembles(max_neurons=64))
    assert notes == {"parts": {}}
    _, notes = rewritten(large(slice(40, 50)), SplitEnsembles(max_neurons=64))
    assert notes == {"parts": {"large": 2}}


def test_a_probe_may_begin_with_the_first_neuron_of_a_part() -> None:
    network = large(slice(50, 60))
    split, _ = rewritten(network, SplitEnsembles(max_neurons=64))
    probe = split.stand_ins[network.probes[0]]
    assert split.names[probe.obj.ensemble] == "large[2/2]"
    assert probe.slice == slice(0, 10)


def test_a_network_without_large_ensembles_is_unchanged() -> None:
    network = large()
    split, _ = rewritten(network, SplitEnsembles())
    assert split.network is network


def pieces(rewrite: Rewrite) -> dict[str, Piece]:
    assert set(rewrite.pieces) <= set(rewrite.network.all_ensembles)
    return {rewrite.names[ensemble]: piece for ensemble, piece in rewrite.pieces.items()}


def test_pieces_name_their_owner() -> None:
    split, _ = rewritten(large(), SplitEnsembles(max_neurons=40))
    assert pieces(split) == {
        "large[1/3]": Piece("large", 0, 3),
        "large[2/3]": Piece("large", 1, 3),
        "large[3/3]": Piece("large", 2, 3),
        "source[1/2]": Piece("source", 0, 2),
        "source[2/2]": Piece("source", 1, 2),
    }


def test_a_label_that_looks_like_a_piece_makes_no_piece() -> None:
    network = large()
    network.ensembles[0].label = "pool[1/2]"
    split, _ = rewritten(network, SplitEnsembles(max_neurons=64), Fuse(max_neurons=64))
    assert pieces(split) == {
        "large[1/2]": Piece("large", 0, 2),
        "large[2/2]": Piece("large", 1, 2),
    }


def test_pieces_survive_passes_that_leave_them_whole() -> None:
    network = large()
    passes = (SplitEnsembles(max_neurons=64), Fuse(max_neurons=64), DecodePath())
    assert list(pieces(rewritten(network, *passes)[0]).values()) == [
        Piece("large", 0, 2),
        Piece("large", 1, 2),
    ]


def test_pieces_that_are_fused_are_no_longer_pieces() -> None:
    """Two pieces of 50 neurons fill one ensemble of 100, and the third is alone in another."""
    with nengo.Network(seed=2) as network:
        nengo.Ensemble(150, 1, label="large")
    fused, _ = rewritten(network, SplitEnsembles(max_neurons=50), Fuse(max_neurons=100))
    assert [e.n_neurons for e in fused.network.ensembles] == [100, 50]
    assert pieces(fused) == {"large[3/3]": Piece("large", 2, 3)}


def test_probes_may_read_neurons_by_an_array_of_numbers() -> None:
    with nengo.Network(seed=2) as network:
        large = nengo.Ensemble(150, 1, label="large")
        probe = nengo.Probe(large.neurons[np.array([60, 55])])
    split, _ = rewritten(network, SplitEnsembles(max_neurons=50))
    assert split.stand_ins[probe].slice == [10, 5]
