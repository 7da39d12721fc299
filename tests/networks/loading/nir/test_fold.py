"""Graphs folded between populations: their order and depths."""

from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import folded, lif, weights, wired

FIRST, LAST = nir_graphs.ends(2, 2)


def test_populations_come_after_their_sources(tmp_path):
    nodes = {"a": lif(2), "b": lif(2), "c": lif(2), "i": FIRST, "o": LAST}
    nodes |= {f"w{n}": weights(2, 2) for n in range(5)}
    edges = "i>w0 w0>c c>w1 w1>b b>w2 w2>a a>w3 w3>c c>w4 w4>a a>o"
    found = folded(tmp_path, wired(nodes, edges))
    assert list(found.populations) == ["c", "b", "a"]
    assert [one.depth for one in found.populations.values()] == [1, 2, 3]
