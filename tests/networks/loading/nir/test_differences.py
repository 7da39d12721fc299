"""The differences between populations on the chip and in NIR, in words."""

from pathlib import Path

import nir
import numpy as np

import spikeport.nir
from spikeport.counted import percent
from spikeport.networks.loading.nir.differences import differences
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, written


def differences_of(folder: Path, graph: nir.NIRGraph, at_once: float = 1.0) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, text in differences(
        spikeport.nir.load(written(folder, graph), DT_S, at_once=at_once)
    ):
        found.setdefault(name, []).append(text)
    return found


def test_each_population_lists_its_differences_from_nir(tmp_path):
    found = differences_of(tmp_path, nir_graphs.recurrent(bias=0.2))
    assert found["hidden"][:2] == [
        "spikes are 1 step late: each connection takes one",
        "voltage decays by 410/4096 a step, up to 0.098 % off, and rounds towards 0",
    ]
    assert "its bias is a source on the host, which spikes in every step from 2 on" in found["read"]
    for start in ("the voltage cannot fall below -", "the chip adds up to 0.0"):
        assert any(text.startswith(start) for text in found["read"])


def test_the_share_of_weights_beyond_which_inputs_wrap_is_named(tmp_path):
    first, last = nir_graphs.ends(200, 5)
    weights = nir.Linear(weight=np.random.default_rng(0).normal(0, 0.5, (5, 200)))
    graph = nir_graphs.graph(input=first, w=weights, n=nir_graphs.lif(5), output=last)
    share = spikeport.nir.load(written(tmp_path, graph), DT_S, at_once=0.125).units["n"].at_once
    assert 0.125 <= share < 1
    text = f"inputs wrap around if over {percent(share)} of its weights act in one step"
    assert text in differences_of(tmp_path, graph, 0.125)["n"]
    assert not any("wrap" in text for text in differences_of(tmp_path, graph)["n"])


def test_a_wrap_of_many_equal_weights_is_named(tmp_path):
    first, last = nir_graphs.ends(400, 2)
    weights = nir.Linear(weight=np.full((2, 400), 0.1))
    graph = nir_graphs.graph(input=first, w=weights, n=nir_graphs.lif(2), output=last)
    assert any(
        text.startswith("inputs wrap around if over")
        for text in differences_of(tmp_path, graph)["n"]
    )


def test_reset_leak_and_many_time_constants_are_named(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(3, 4)
    neurons = nir_graphs.cuba(4, v_leak=0.25, v_reset=-0.5)
    neurons.tau_mem = np.array([5e-3, 1e-2, 1e-2, 2e-2])
    found = differences_of(
        tmp_path, nir_graphs.graph(input=first, w=nir_graphs.affine(rng, 4, 3), n=neurons, o=last)
    )
    assert "3 voltage decays; each is a profile of its core" in found["n"]
    assert "its bias is a source on the host, which spikes in every step from 1 on" in found["n"]


def test_readouts_and_paths_of_different_lengths_are_named(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(3, 3)
    nodes = {"i": first, "a": nir_graphs.lif(3), "b": nir_graphs.lif(3), "o": last}
    nodes |= {name: nir_graphs.affine(rng, 3, 3) for name in ("w", "v", "u")}
    nodes["r"] = nir.LI(tau=np.full(3, 1e-2), r=np.ones(3), v_leak=np.ones(3))
    nodes["c"] = nir_graphs.lif(3)
    edges = [("i", "w"), ("w", "a"), ("a", "v"), ("v", "b"), ("i", "b"), ("b", "u"), ("u", "r")]
    edges += [("a", "c"), ("b", "c")]
    graph = nir.NIRGraph(nodes=nodes, edges=[*edges, ("r", "o")], type_check=False)
    found = differences_of(tmp_path, graph)
    assert not any("early" in text for text in found["b"])  # the host holds inputs back
    assert (
        found["c"][-1] == "spikes of a arrive 1 step early, relative to those on its longest path"
    )
    assert found["r"] == [
        "computed on the host, in floating point: it reads spikes and sends none",
        "its voltage is 3 steps late",
        "in float, spikes reach it a step before its bias: `simulate` counts that as an error",
    ]


def test_outputs_that_read_paths_of_different_lengths_are_named(tmp_path):
    first, last = nir_graphs.ends(2, 2)
    nodes = {"i": first, "a": nir_graphs.lif(2), "b": nir_graphs.lif(2), "o": last}
    graph = nir_graphs.wired(nodes, "i>a a>b a>o b>o")
    assert differences_of(tmp_path, graph)["o"] == [
        "values of a come 1 step earlier than its latest ones"
    ]


def test_readouts_whose_bias_is_late_in_float_are_named(tmp_path):
    def of(bias: float, neurons: bool) -> list[str]:
        first, last = nir_graphs.ends(2, 2)
        before = {"i": first, "n": nir_graphs.lif(2)} if neurons else {"i": first}
        read = nir.LI(tau=np.full(2, 1e-2), r=np.full(2, 10.0), v_leak=np.zeros(2))
        weights = nir_graphs.weights(2, 2, bias=bias)
        graph = nir_graphs.graph(**before, w=weights, l=read, o=last)
        return [text for text in differences_of(tmp_path, graph)["l"] if "before its bias" in text]

    assert len(of(0.3, neurons=True)) == 1
    assert of(0.0, neurons=True) == of(0.3, neurons=False) == []
