"""Signals of graphs: matrices, biases, shapes, and refusals."""

import nir
import numpy as np
import pytest

from spikeport.networks.loading.nir import signals
from spikeport.reading.mismatch import MismatchError
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import folded, lif, weights, wired

FIRST, LAST = nir_graphs.ends(2, 2)


def lone() -> nir.LIF:
    """Return neurons whose parameters have no axis."""
    return nir.LIF(*map(np.float32, (1e-2, 10.0, 0.0, 1.0)), v_reset=np.float32(0))


def matrix(*shape: int) -> nir.Input:
    """Return an input of some axes."""
    return nir.Input(input_type={"input": np.array(shape)})


def test_matrices_multiply_and_a_bias_is_added_once(tmp_path):
    nodes = {"i": FIRST, "w": weights(3, 2, 2.0, 1.0), "s": nir.Scale(scale=np.full(3, 10.0))}
    nodes |= {
        "again": weights(3, 2, -1.0),
        "n": lif(3),
        "back": weights(2, 3, 0.5, 0.25),
        "o": nir_graphs.ends(2, 3)[1],
    }
    found = folded(tmp_path, wired(nodes, "i>w i>again w>s again>s s>n n>back back>w n>o"))
    signal = found.populations["n"].input
    assert signal.constant.tolist() == [10 * (1 + 2 * 2 * 0.25)] * 3
    assert signal.parts["i"].toarray().tolist() == [[10 * (2 - 1)] * 2] * 3
    assert signal.parts["n"].toarray().tolist() == [[10 * 2 * 2 * 0.5] * 3] * 3


def test_neurons_with_parameters_of_channels_take_the_shape_of_their_input(tmp_path):
    first = nir.Input(input_type={"input": np.array([2, 3, 3])})
    fire = nir_graphs.integrate(2, 1, 1)
    last = nir.Output(output_type={"output": np.array([2, 3, 3])})
    found = folded(tmp_path, wired({"i": first, "n": fire, "o": last}, "i>n n>o"))
    assert found.populations["n"].dynamics.shape == found.outputs["o"].shape == (2, 3, 3)


def test_neurons_with_scalar_parameters_take_the_shape_of_their_input(tmp_path):
    nodes = {"i": FIRST, "w": weights(3, 2), "n": lone(), "again": weights(3, 3), "m": lone()}
    nodes["o"] = nir_graphs.ends(2, 3)[1]
    found = folded(tmp_path, wired(nodes, "again>n n>again i>w w>n n>m m>o"))
    assert [population.size for population in found.populations.values()] == [3, 3]
    assert found.populations["n"].dynamics.gain.tolist() == pytest.approx([1.0] * 3)


@pytest.mark.parametrize("shape", [(24,), (6, 4), (2, 12), (1, 2, 3, 4), (2, 3, 4, 1)])
def test_axes_may_be_merged_in_order_and_axes_of_1_be_left_out(tmp_path, shape):
    nodes = {"i": matrix(2, 3, 4), "j": matrix(24), "n": nir_graphs.integrate(*shape)}
    assert folded(tmp_path, wired(nodes, "i>n j>n")).populations["n"].size == 24


@pytest.mark.parametrize(
    ("nodes", "edges", "message"),
    [
        ({"w": weights(2, 2), "v": weights(2, 2), "n": lif(2)}, "i>w w>v v>w v>n n>o",
         "expected neurons in every cycle, found none in one through "),
        ({"n": lif(2), "o": nir_graphs.ends(2, 3)[1]}, "i>n n>o",
         "expected (3,) into node o, found (2,)"),
        ({"i": matrix(2, 3), "n": nir_graphs.integrate(3, 2)}, "i>n",
         "expected (3, 2) into node n, found (2, 3)"),
        ({"i": matrix(2, 3), "j": matrix(3, 2), "n": lif(6)}, "i>n j>n",
         "expected (6,) into node n, found (2, 3) and (3, 2)"),
        ({"n": lif(3)}, "i>n n>o", "expected (3,) into node n, found (2,)"),
        ({"w": weights(3, 2), "n": lif(3)}, "i>w i>n w>n n>o", "expected (3,) into node n, found"),
        ({"w": weights(2, 2), "n": lif(2)}, "w>n n>o", "expected an edge that leads to node w, f"),
        ({"n": lif(2), "w": weights(2, 2), "m": lif(2)}, "i>n n>o o>w w>m",
         "expected output o without edges out of it, found an edge"),
        ({"i": nir.Input(input_type={"input": np.array([2**10, 2**11])}), "n": lif(2)}, "n>o",
         "expected from 1 to 1,048,576 values of input i, found (1024, 2048)"),
        ({"i": nir.Input(input_type={"input": np.array([2**20])}), "n": lif(2)}, "n>o",
         "expected at most 1,048,576 inputs and neurons, found 1,048,578"),
        ({"a": weights(1, 2**15), "b": weights(2**15, 1), "n": lif(2),
          "i": nir.Input(input_type={"input": np.array([2**15])})}, "i>a a>b n>o",
         "expected at most 134,217,728 multiplications for a matrix of node b, "
         "found 1,073,741,824"),
    ],
)  # fmt: skip
def test_nodes_that_do_not_fit_together_are_refused_by_name(tmp_path, nodes, edges, message):
    with pytest.raises(MismatchError) as caught:
        folded(tmp_path, wired({"i": FIRST, "o": LAST} | nodes, edges))
    assert str(caught.value).startswith(message)


def test_too_many_weights_of_all_nodes_together_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(signals, "MOST_WEIGHTS", 100)
    nodes = {"i": FIRST, "n": lif(2), "o": LAST} | {f"w{i}": weights(2, 2) for i in range(30)}
    edges = "i>w0 w29>n n>o " + " ".join(f"w{i}>w{i + 1}" for i in range(29))
    message = "at most 100 weights in total, found more, counted up to node w1"
    with pytest.raises(MismatchError, match=message):
        folded(tmp_path, wired(nodes, edges))


def test_neurons_with_scalar_parameters_in_a_cycle_without_input_are_single(tmp_path):
    first, last = nir_graphs.ends(1, 1)
    found = folded(
        tmp_path, wired({"a": lone(), "b": lone(), "i": first, "o": last}, "a>b b>a a>o")
    )
    assert [one.size for one in found.populations.values()] == [1, 1]
    nodes = {"a": lone(), "b": lone(), "w": weights(1, 1), "i": first, "o": last}
    found = folded(tmp_path, wired(nodes, "i>a a>o b>w w>b"))
    assert {name: one.size for name, one in found.populations.items()} == {"a": 1, "b": 1}
    nodes = {"n": lone(), "w": weights(1, 1), "v": weights(1, 1), "i": first, "o": last}
    with pytest.raises(
        MismatchError, match=r"neurons in every cycle, found none in one through [wv]$"
    ):
        folded(tmp_path, wired(nodes, "w>v v>w v>n i>o"))


def test_products_of_parallel_nodes_are_counted_as_they_are_made(tmp_path, monkeypatch):
    """Each has one weight from its input, and many from the graph's."""
    monkeypatch.setattr(signals, "MOST_WEIGHTS", 100)
    nodes = {"i": FIRST, "one": weights(1, 2), "n": lif(2), "o": LAST}
    nodes |= {f"w{i}": weights(2, 1) for i in range(40)}
    edges = "i>one n>o " + " ".join(f"one>w{i} w{i}>n" for i in range(40))
    with pytest.raises(MismatchError, match="counted up to node w"):
        folded(tmp_path, wired(nodes, edges))
