"""Checks of graphs of populations: read-outs, delays, and inputs that are held back."""

import nir
import numpy as np
import pytest

from spikeport.networks.loading.nir import checks
from spikeport.reading.mismatch import MismatchError
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, folded, lif, weights, wired

FIRST, LAST = nir_graphs.ends(2, 2)


def delays(n: int = 2) -> nir.Delay:
    return nir.Delay(delay=np.full(n, DT_S))


def test_a_readout_that_feeds_neurons_is_refused(tmp_path):
    nodes = {"i": FIRST, "r": nir.LI(*np.ones((3, 2)) * 0.01), "n": lif(2), "o": LAST}
    with pytest.raises(MismatchError) as caught:
        folded(tmp_path, wired(nodes, "i>r r>n n>o"))
    assert str(caught.value) == "expected spikes into node n, found the voltage of LI r"


@pytest.mark.parametrize("other", ["i", "n"])
def test_an_output_of_spikes_and_voltages_is_refused(tmp_path, other):
    nodes = {"i": FIRST, "r": nir.LI(*np.ones((3, 2)) * 0.01), "n": lif(2), "o": LAST}
    with pytest.raises(MismatchError) as caught:
        folded(tmp_path, wired(nodes, f"i>r i>n r>o {other}>o"))
    assert str(caught.value) == (
        "expected spikes alone or voltages alone into node o, found both, a voltage of r among them"
    )


def test_inputs_count_once_for_each_of_their_delays(tmp_path, monkeypatch):
    monkeypatch.setattr(checks, "SIZE", 8)
    nodes = {"i": nir_graphs.ends(4, 1)[0], "w": weights(1, 4), "o": nir_graphs.ends(4, 1)[1]}
    nodes |= {"a": lif(1), "b": lif(1)}
    assert folded(tmp_path, wired(nodes, "i>w w>a a>b w>b b>o"))
    nodes["c"] = lif(1)
    with pytest.raises(MismatchError) as caught:
        folded(tmp_path, wired(nodes, "i>w w>a a>b w>b b>c w>c c>o"))
    assert str(caught.value) == (
        "expected at most 8 inputs, counting an input once for each of its delays, found 12"
    )


@pytest.mark.parametrize(
    ("edges", "message"),
    [
        ("i>n i>d d>n n>o", "equal delays on all paths to node n, found 0 and 1 steps"),
        ("i>w w>n i>d d>n n>o", "equal delays on all paths to node n, found 0 and 1 steps"),
        ("i>n n>m n>d d>o m>o", "equal delays on all paths to node o, found 0 and 1 steps"),
        ("i>n n>d d>m i>m m>o", "equal delays on all paths to node m, found 0 and 1 steps"),
        ("i>d d>n n>m i>m m>o", "equal delays on all paths to node m, found 0 and 1 steps"),
        ("i>d d>n j>n n>o", "equal delays on all paths to node n, found 0 and 1 steps"),
        ("i>n n>d d>e e>n n>o", "at most 1 delay in the cycle of n and n, found 2"),
        ("i>n n>d d>m m>e e>n n>o", "at most 1 delay in the cycle of m and n, found 2"),
    ],
)
def test_unequal_delays_of_paths_and_two_delays_in_a_cycle_are_refused(tmp_path, edges, message):
    nodes = {"i": FIRST, "j": FIRST, "o": LAST, "n": lif(2), "m": lif(2), "w": weights(2, 2)}
    nodes |= {"d": delays(), "e": delays()}
    used = {name: nodes[name] for edge in edges.split() for name in edge.split(">")}
    with pytest.raises(MismatchError) as caught:
        folded(tmp_path, wired(used, edges))
    assert str(caught.value) == f"expected {message}"


@pytest.mark.parametrize(
    "edges",
    [
        "i>d d>n n>o",
        "i>d d>n i>e e>m m>o n>o",
        "i>n n>d d>n n>o",
        "i>d d>n n>w w>n n>o",
        "i>n n>d d>m m>n m>o",
    ],
)
def test_delays_that_all_paths_share_and_one_in_a_cycle_are_ignored(tmp_path, edges):
    nodes = {"i": FIRST, "o": LAST, "n": lif(2), "m": lif(2), "w": weights(2, 2)}
    nodes |= {"d": delays(), "e": delays()}
    used = {name: nodes[name] for edge in edges.split() for name in edge.split(">")}
    assert folded(tmp_path, wired(used, edges))
