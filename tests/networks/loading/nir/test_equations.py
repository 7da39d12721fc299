"""The equations of a folded graph, compared with NIR's node by node."""

import nir
import numpy as np
import pytest

from spikeport.networks.loading.nir import equations
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, folded, spikes
from tests.helpers.nir_referee import Referee


@pytest.mark.parametrize("bias", [0.0, 0.3])
def test_recurrent_neurons_spike_as_the_referees(tmp_path, bias):
    graph = nir_graphs.recurrent(bias)
    inputs = {"input": spikes(6)}
    found = equations.run(folded(tmp_path, graph), inputs)
    wanted = Referee(graph, DT_S).run(inputs)
    assert wanted["read"].sum() > 10
    for name, rows in wanted.items():
        np.testing.assert_array_equal(found[name], rows)


def test_readouts_have_the_voltage_of_the_referee(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(6, 2)
    values = {"r": np.full(2, 3.0), "v_leak": np.full(2, 0.1)}
    filtered = nir.CubaLI(
        tau_syn=np.full(2, 2e-3), tau_mem=np.array([5e-3, 9e-3]), w_in=np.full(2, 2.0), **values
    )
    graph = nir_graphs.graph(
        input=first, a=nir_graphs.affine(rng, 8, 6), hidden=nir_graphs.lif(8),
        b=nir_graphs.affine(rng, 2, 8, bias=0.1), read=filtered, output=last,
    )  # fmt: skip
    inputs = {"input": spikes(6)}
    wanted = Referee(graph, DT_S).run(inputs)["read"]
    assert np.abs(wanted).max() > 0.3
    np.testing.assert_allclose(equations.run(folded(tmp_path, graph), inputs)["read"], wanted)


def test_neurons_of_a_nested_graph_spike_as_those_of_the_referees_flat_graph(tmp_path):
    graph, inputs = nir_graphs.nested(), {"input": spikes(5)}
    outer, inner = graph.nodes, graph.nodes["inner"].nodes
    flat = {"scale": inner["scale"], "weights": inner["weights"], "inner.neurons": inner["neurons"]}
    after = {name: outer[name] for name in ("out", "delay", "gate", "output")}
    referee = Referee(nir_graphs.graph(input=outer["input"], **flat, **after), DT_S)
    wanted, found = referee.run(inputs), equations.run(folded(tmp_path, graph), inputs)
    assert found.keys() == wanted.keys() == {"inner.neurons", "gate"}
    for name, rows in wanted.items():
        assert rows.sum() > 100
        np.testing.assert_array_equal(found[name], rows)


def test_neurons_after_a_pool_spike_as_the_referees(tmp_path):
    rng = np.random.default_rng(0)
    graph = nir_graphs.graph(
        input=nir.Input(input_type={"input": np.array([2, 6, 6])}),
        pool=nir.SumPool2d(np.array([3, 2]), np.array([1, 2]), np.array([0, 0])),
        flat=nir.Flatten({"input": np.array([2, 4, 3])}, start_dim=0),
        weights=nir_graphs.affine(rng, 5, 24),
        neurons=nir_graphs.integrate(5),
        output=nir_graphs.ends(1, 5)[1],
    )
    rows = spikes(72)
    wanted = Referee(graph, DT_S).run({"input": rows.reshape(-1, 2, 6, 6)})["neurons"]
    found = equations.run(folded(tmp_path, graph), {"input": rows})["neurons"]
    assert wanted.sum() > 20
    np.testing.assert_array_equal(found, wanted)
