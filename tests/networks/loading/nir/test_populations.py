"""Graphs folded between populations: matrices, biases, order, depths and what cannot be."""

import nir
import numpy as np
import pytest

from spikeport.networks.loading.nir import populations
from spikeport.networks.loading.nir.graph import flattened
from spikeport.networks.loading.nir.populations import Folded, folded
from spikeport.reading.hdf5 import read
from spikeport.reading.mismatch import MismatchError
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, lif, written


def fold(folder, nodes, edges) -> Folded:
    pairs = [tuple(edge.split(">")) for edge in edges.split()]
    graph = nir.NIRGraph(nodes=nodes, edges=pairs, type_check=False)
    return folded(flattened(read(written(folder, graph))), DT_S)


def weights(n_out, n_in, value=1.0, bias=0.0):
    return nir.Affine(weight=np.full((n_out, n_in), value), bias=np.full(n_out, bias))


FIRST, LAST = nir_graphs.ends(2, 2)


def test_matrices_multiply_and_a_bias_is_added_once(tmp_path):
    nodes = {"i": FIRST, "w": weights(3, 2, 2.0, 1.0), "s": nir.Scale(scale=np.full(3, 10.0))}
    nodes |= {
        "again": weights(3, 2, -1.0),
        "n": lif(3),
        "back": weights(2, 3, 0.5, 0.25),
        "o": nir_graphs.ends(2, 3)[1],
    }
    found = fold(tmp_path, nodes, "i>w i>again w>s again>s s>n n>back back>w n>o")
    signal = found.populations["n"].input
    assert signal.constant.tolist() == [10 * (1 + 2 * 2 * 0.25)] * 3
    assert signal.parts["i"].toarray().tolist() == [[10 * (2 - 1)] * 2] * 3
    assert signal.parts["n"].toarray().tolist() == [[10 * 2 * 2 * 0.5] * 3] * 3


def test_populations_come_after_those_that_lead_to_them(tmp_path):
    nodes = {"a": lif(2), "b": lif(2), "c": lif(2), "i": FIRST, "o": LAST}
    nodes |= {f"w{n}": weights(2, 2) for n in range(5)}
    edges = "i>w0 w0>c c>w1 w1>b b>w2 w2>a a>w3 w3>c c>w4 w4>a a>o"
    found = fold(tmp_path, nodes, edges)
    assert list(found.populations) == ["c", "b", "a"]
    assert [one.depth for one in found.populations.values()] == [1, 2, 3]
    late = {name: dict(found.late(one)) for name, one in found.populations.items()}
    assert late == {"c": {"a": -2}, "b": {}, "a": {"c": 1}}


def test_neurons_with_parameters_of_channels_are_as_many_as_what_they_get(tmp_path):
    first = nir.Input(input_type={"input": np.array([2, 3, 3])})
    fire = nir_graphs.integrate(2, 1, 1)
    last = nir.Output(output_type={"output": np.array([2, 3, 3])})
    found = fold(tmp_path, {"i": first, "n": fire, "o": last}, "i>n n>o")
    assert found.populations["n"].dynamics.shape == found.outputs["o"].shape == (2, 3, 3)


def test_inputs_of_deep_neurons_are_held_back(tmp_path):
    found = fold(tmp_path, {"i": FIRST, "a": lif(2), "b": lif(2), "o": LAST}, "i>a a>b i>b b>o")
    assert [found.held(one) for one in found.populations.values()] == [0, 1]
    assert not [late for one in found.populations.values() for late in found.late(one)]


def test_neurons_of_one_value_have_the_shape_of_what_reaches_them(tmp_path):
    one = nir.LIF(*map(np.float32, (1e-2, 10.0, 0.0, 1.0)), v_reset=np.float32(0))
    nodes = {"i": FIRST, "w": weights(3, 2), "n": one, "again": weights(3, 3), "m": one, "o": LAST}
    nodes["o"] = nir_graphs.ends(2, 3)[1]
    found = fold(tmp_path, nodes, "again>n n>again i>w w>n n>m m>o")
    assert [population.size for population in found.populations.values()] == [3, 3]
    assert found.populations["n"].dynamics.gain.tolist() == pytest.approx([1.0] * 3)


@pytest.mark.parametrize(
    ("nodes", "edges", "message"),
    [
        ({"w": weights(2, 2), "v": weights(2, 2), "n": lif(2)}, "i>w w>v v>w v>n n>o",
         "expected neurons in every cycle, found none at "),
        ({"n": lif(2), "o": nir_graphs.ends(2, 3)[1]}, "i>n n>o",
         "expected (3,) into node o, found (2,)"),
        ({"n": lif(3)}, "i>n n>o", "expected (3,) into node n, found (2,)"),
        ({"w": weights(3, 2), "n": lif(3)}, "i>w i>n w>n n>o", "expected (3,) into node n, found"),
        ({"w": weights(2, 2), "n": lif(2)}, "w>n n>o", "expected an edge that leads to node w, f"),
        ({"r": nir.LI(*np.ones((3, 2)) * 0.01), "n": lif(2)}, "i>r r>n n>o",
         "expected spikes into node n, found the voltage of LI r"),
        ({"n": lif(2), "w": weights(2, 2), "m": lif(2)}, "i>n n>o o>w w>m",
         "expected output o at an end, found it within a path"),
        ({"i": nir.Input(input_type={"input": np.array([2**10, 2**11])}), "n": lif(2)}, "n>o",
         "expected from 1 to 1,048,576 values of input i, found (1024, 2048)"),
        ({"i": nir.Input(input_type={"input": np.array([2**20])}), "n": lif(2)}, "n>o",
         "expected at most 1,048,576 inputs and neurons, found 1,048,578"),
        ({"a": weights(1, 2**15), "b": weights(2**15, 1), "n": lif(2),
          "i": nir.Input(input_type={"input": np.array([2**15])})}, "i>a a>b n>o",
         "expected matrices with at most 134,217,728 products up to node b, found 1,073,741,824"),
    ],
)  # fmt: skip
def test_what_cannot_be_on_a_chip_is_refused_by_name(tmp_path, nodes, edges, message):
    with pytest.raises(MismatchError) as caught:
        fold(tmp_path, {"i": FIRST, "o": LAST} | nodes, edges)
    assert str(caught.value).startswith(message)


def test_inputs_are_counted_for_each_depth(tmp_path, monkeypatch):
    monkeypatch.setattr(populations, "SIZE", 8)
    nodes = {"i": nir_graphs.ends(4, 1)[0], "w": weights(1, 4), "o": nir_graphs.ends(4, 1)[1]}
    nodes |= {"a": lif(1), "b": lif(1)}
    assert fold(tmp_path, nodes, "i>w w>a a>b w>b b>o")
    nodes["c"] = lif(1)
    with pytest.raises(MismatchError) as caught:
        fold(tmp_path, nodes, "i>w w>a a>b w>b b>c w>c c>o")
    assert str(caught.value) == (
        "expected at most 8 inputs, each once for each depth it leads to, found 12"
    )


def test_weights_of_all_nodes_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(populations, "WEIGHTS", 100)
    nodes = {"i": FIRST, "n": lif(2), "o": LAST} | {f"w{i}": weights(2, 2) for i in range(30)}
    edges = "i>w0 w29>n n>o " + " ".join(f"w{i}>w{i + 1}" for i in range(29))
    with pytest.raises(MismatchError, match="at most 100 weights in all, found more up to node w1"):
        fold(tmp_path, nodes, edges)


def delays(n: int = 2) -> nir.Delay:
    return nir.Delay(delay=np.full(n, DT_S))


@pytest.mark.parametrize(
    ("edges", "message"),
    [
        ("i>n i>d d>n n>o", "equal delays on all ways to node n, found 0 and 1 steps"),
        ("i>w w>n i>d d>n n>o", "equal delays on all ways to node n, found 0 and 1 steps"),
        ("i>n n>m n>d d>o m>o", "equal delays on all ways to node o, found 0 and 1 steps"),
        ("i>n n>d d>m i>m m>o", "equal delays on all ways to node m, found 0 and 1 steps"),
        ("i>d d>n n>m i>m m>o", "equal delays on all ways to node m, found 0 and 1 steps"),
        ("i>d d>n j>n n>o", "equal delays on all ways to node n, found 0 and 1 steps"),
        ("i>n n>d d>e e>n n>o", "at most 1 delay in the cycle of n and n, found 2"),
        ("i>n n>d d>m m>e e>n n>o", "at most 1 delay in the cycle of m and n, found 2"),
    ],
)
def test_a_delay_beside_a_way_without_it_is_refused(tmp_path, edges, message):
    nodes = {"i": FIRST, "j": FIRST, "o": LAST, "n": lif(2), "m": lif(2), "w": weights(2, 2)}
    nodes |= {"d": delays(), "e": delays()}
    used = {name for edge in edges.split() for name in edge.split(">")}
    with pytest.raises(MismatchError) as caught:
        fold(tmp_path, {name: node for name, node in nodes.items() if name in used}, edges)
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
def test_delays_of_all_ways_alike_and_of_what_leads_back_are_none(tmp_path, edges):
    nodes = {"i": FIRST, "o": LAST, "n": lif(2), "m": lif(2), "w": weights(2, 2)}
    nodes |= {"d": delays(), "e": delays()}
    used = {name for edge in edges.split() for name in edge.split(">")}
    assert fold(tmp_path, {name: node for name, node in nodes.items() if name in used}, edges)


def lone() -> nir.LIF:
    """Return neurons whose parameters have no axis."""
    return nir.LIF(*map(np.float32, (1e-2, 10.0, 0.0, 1.0)), v_reset=np.float32(0))


def test_neurons_of_one_value_in_a_cycle_that_no_input_reaches_are_one(tmp_path):
    first, last = nir_graphs.ends(1, 1)
    found = fold(tmp_path, {"a": lone(), "b": lone(), "i": first, "o": last}, "a>b b>a a>o")
    assert [one.size for one in found.populations.values()] == [1, 1]
    nodes = {"a": lone(), "b": lone(), "w": weights(1, 1), "i": first, "o": last}
    found = fold(tmp_path, nodes, "i>a a>o b>w w>b")
    assert {name: one.size for name, one in found.populations.items()} == {"a": 1, "b": 1}
    nodes = {"n": lone(), "w": weights(1, 1), "v": weights(1, 1), "i": first, "o": last}
    with pytest.raises(MismatchError, match="neurons in every cycle, found none at"):
        fold(tmp_path, nodes, "w>v v>w v>n i>o")
