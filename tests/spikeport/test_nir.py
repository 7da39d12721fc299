"""`spikeport.nir.load`: the networks of NIR graphs, and refusals."""

import numpy as np
import pytest

import spikeport.nir
from spikeport.errors import MissingExtraError, UsageError
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, written


def test_a_loaded_graph_has_named_inputs_populations_and_outputs(tmp_path):
    network = spikeport.nir.load(str(written(tmp_path, nir_graphs.recurrent())), DT_S)
    assert network.label == "graph"
    assert {name: node.size_out for name, node in network.inputs.items()} == {"input": 6}
    assert {name: e.n_neurons for name, e in network.populations.items()} == {
        "hidden": 12,
        "read": 4,
    }
    assert {name: node.size_in for name, node in network.outputs.items()} == {"output": 4}


@pytest.mark.parametrize("dt", [0, -1e-3, float("nan"), float("inf"), "1 ms"])
def test_a_time_step_that_is_not_a_positive_number_is_refused(tmp_path, dt):
    with pytest.raises(UsageError, match="the time step of a NIR graph is a number of seconds abo"):
        spikeport.nir.load(tmp_path / "graph.nir", dt)


def test_arguments_may_be_numpy_numbers(tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    network = spikeport.nir.load(path, np.float32(DT_S), at_once=np.float32(0.5))
    assert network.label == "graph"


def test_a_weight_of_three_synapses_is_refused(tmp_path):
    with pytest.raises(UsageError, match="parts=3: the synapses of a weight must be 1 or 2"):
        spikeport.nir.load(tmp_path / "graph.nir", DT_S, parts=3)


@pytest.mark.parametrize("share", [0, -0.5, 1.01, float("nan"), "all"])
def test_an_invalid_share_of_sources_is_refused(tmp_path, share):
    with pytest.raises(
        UsageError, match="the share of a neuron's sources must be above 0 and at most 1"
    ):
        spikeport.nir.load(tmp_path / "graph.nir", DT_S, at_once=share)


def test_a_missing_file_or_an_invalid_graph_is_refused_with_its_path(tmp_path):
    path = tmp_path / "graph.nir"
    with pytest.raises(UsageError) as caught:
        spikeport.nir.load(path, DT_S)
    assert str(caught.value) == f"{path}: no such file"
    graph = nir_graphs.recurrent()
    graph.nodes["hidden"].tau_mem = np.full(12, 1e-4)
    written(tmp_path, graph)
    with pytest.raises(UsageError) as caught:
        spikeport.nir.load(path, DT_S)
    assert str(caught.value) == (
        f"NIR graph '{path}': expected tau_mem of at least 0.001 s (one step of --dt) in "
        "node hidden, found 0.0001 s; give another --dt"
    )


def test_the_error_without_h5py_names_the_extra(tmp_path, monkeypatch):
    path = written(tmp_path, nir_graphs.recurrent())
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"install it with: pip install 'spikeport\[nir\]'"):
        spikeport.nir.load(path, DT_S)
