"""Populations: the steps by which the host holds their inputs back."""

from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import folded, lif, wired


def test_inputs_of_deep_neurons_are_held_back(tmp_path):
    first, last = nir_graphs.ends(2, 2)
    nodes = {"i": first, "a": lif(2), "b": lif(2), "o": last}
    found = folded(tmp_path, wired(nodes, "i>a a>b i>b b>o"))
    assert [found.held_steps(one) for one in found.populations.values()] == [0, 1]
