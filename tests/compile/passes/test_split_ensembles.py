import nengo
import pytest
from random_networks import assert_equal_in_float, random_network, rewritten
from same_run import context, small_chip

from spikeport.compile.names import Names
from spikeport.compile.passes.split_ensembles import SplitEnsembles
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.compile.verdict.lint import lint


@pytest.mark.parametrize("seed", range(4))
def test_the_same_in_float(seed: int) -> None:
    split = assert_equal_in_float(random_network(seed), SplitEnsembles(max_neurons=11))
    sizes = {e.n_neurons for e in split.network.all_ensembles}
    assert sizes == {6, 7, 8, 12}  # all neurons of one of 12 are probed


def large(probe_neurons: slice = slice(0, 5)) -> nengo.Network:
    with nengo.Network(seed=2) as network:
        source = nengo.Ensemble(50, 2, label="source")
        large = nengo.Ensemble(100, 2, label="large")
        nengo.Connection(source, large[1], function=lambda x: x[0] * x[1])
        nengo.Connection(large, nengo.Node(lambda _t, x: x, size_in=2))
        nengo.Probe(large.neurons[probe_neurons])
    return network


def test_parts_take_no_more_than_there_are_input_axons() -> None:
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


def test_slices_of_what_is_split_are_dense() -> None:
    network = large()
    assert lint(network, Names(network))
    split, _ = rewritten(network, SplitEnsembles(max_neurons=64))
    assert not lint(split.network, split.names)


def test_an_ensemble_probed_across_parts_stays() -> None:
    split, notes = rewritten(large(slice(40, 60)), SplitEnsembles(max_neurons=64))
    assert notes == {"parts": {}}
    assert "large" in [e.label for e in split.network.ensembles]


def test_nothing_large_nothing_changed() -> None:
    network = large()
    split, _ = rewritten(network, SplitEnsembles())
    assert split.network is network
