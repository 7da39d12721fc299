"""Graphs folded between populations: their order and depths."""

import itertools

import pytest

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


def test_a_population_without_an_edge_comes_first(tmp_path):
    nodes = {"a": lif(2), "b": lif(2), "i": FIRST, "o": LAST}
    assert list(folded(tmp_path, wired(nodes, "i>b b>o")).populations) == ["a", "b"]


@pytest.mark.parametrize(
    ("edges", "order"),
    [
        ("i>a a>b b>a i>b b>o", "ab"),
        ("i>b i>a a>b b>a b>o", "ba"),
        ("i>c c>b b>a a>c a>o", "cba"),
        ("i>a a>b b>a i>c b>c c>o", "abc"),  # c is as near to the input, but in no cycle
        ("i>a a>a a>b b>o", "ab"),
        ("i>a a>b b>a b>c c>o i>o", "abc"),
    ],
)
def test_no_name_decides_where_a_cycle_begins(tmp_path, edges, order):
    names = sorted(order)
    for given in itertools.permutations(names):
        other = dict(zip(names, given, strict=True))
        nodes = {name: lif(2) for name in names} | {"i": FIRST, "o": LAST}
        renamed = "".join(other.get(letter, letter) for letter in edges)
        found = folded(tmp_path, wired(nodes, renamed))
        assert list(found.populations) == [other[name] for name in order]
