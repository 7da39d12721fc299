"""The differences of a graph's populations, in words."""

from pathlib import Path

import nir
import numpy as np

import spikeport.nir
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


def test_each_population_says_what_it_does_otherwise(tmp_path):
    found = differences_of(tmp_path, nir_graphs.recurrent(bias=0.2))
    assert found["hidden"][:2] == [
        "spikes are 1 step late: each connection takes one",
        "voltage decays by 410/4096 a step, up to 0.10% off, and rounds towards 0",
    ]
    assert "its bias is a source on the host, which spikes in every step from 2 on" in found["read"]
    assert any(text.startswith("the voltage ends at -") for text in found["read"])


def test_the_share_of_sources_beyond_which_inputs_wrap_is_named(tmp_path):
    text = "inputs wrap around if over 0.125 of its sources spike at once"
    assert text in differences_of(tmp_path, nir_graphs.recurrent(), 0.125)["hidden"]
    assert text not in differences_of(tmp_path, nir_graphs.recurrent())["hidden"]


def test_reset_leak_and_many_time_constants_are_named(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(3, 4)
    neurons = nir_graphs.cuba(4, v_leak=0.25, v_reset=-0.5)
    neurons.tau_mem = np.array([5e-3, 1e-2, 1e-2, 2e-2])
    found = differences_of(
        tmp_path, nir_graphs.graph(input=first, w=nir_graphs.affine(rng, 4, 3), n=neurons, o=last)
    )
    assert "starts at its reset voltage, -0.5, not at 0" in found["n"]
    assert "3 voltage decays; each is a profile of its core" in found["n"]
    assert "its leak voltage acts from the first step on, 1 before its input can" in found["n"]


def test_readouts_and_ways_of_different_lengths_are_named(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(3, 3)
    nodes = {"i": first, "a": nir_graphs.lif(3), "b": nir_graphs.lif(3), "o": last}
    nodes |= {name: nir_graphs.affine(rng, 3, 3) for name in ("w", "v", "u")}
    nodes["r"] = nir.LI(tau=np.full(3, 1e-2), r=np.ones(3), v_leak=np.ones(3))
    edges = [("i", "w"), ("w", "a"), ("a", "v"), ("v", "b"), ("i", "b"), ("b", "u"), ("u", "r")]
    graph = nir.NIRGraph(nodes=nodes, edges=[*edges, ("r", "o")], type_check=False)
    found = differences_of(tmp_path, graph)
    assert found["b"][-1] == "spikes of i arrive 1 step early, beside its longest way's"
    assert found["r"] == [
        "computed on the host, in floating point: it reads spikes and sends none",
        "its voltage is 3 steps late",
        "its bias and leak act from the first step on, 3 before its input can",
    ]
