"""Networks of graphs: in float NIR's equations spike for spike, on the chip close to them."""

import nengo
import nir
import numpy as np
import pytest

import spikeport
import spikeport.nir
from spikeport.networks.loading.nir import equations
from spikeport.networks.loading.nir.network import NirNetwork
from tests.helpers import nir_graphs
from tests.helpers.nir_graphs import DT_S, spikes, written

N_STEPS = 150
GRAPHS = {
    "recurrent": (lambda: nir_graphs.recurrent(), 6),
    "recurrent with biases": (lambda: nir_graphs.recurrent(bias=0.3), 6),
    "convolutional": (nir_graphs.convolutional, 72),
    "nested": (nir_graphs.nested, 5),
}


def played(network: NirNetwork, rows: np.ndarray, backend: str) -> dict[str, np.ndarray]:
    """Return what the populations of a network do, from the step on in which input reaches them."""
    network.feeds["input"].play(rows, DT_S)
    depth = {name: one.depth for name, one in network.folded.populations.items()}
    with network:
        probes = {name: nengo.Probe(one.neurons) for name, one in network.populations.items()}
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run_steps(len(rows) + max(depth.values()))
        data = {name: sim.data[probe] for name, probe in probes.items()}
    return {name: values[depth[name] :][: len(rows)] for name, values in data.items()}


@pytest.mark.parametrize("name", GRAPHS)
def test_a_network_spikes_as_nir_does(tmp_path, name):
    make, n_inputs = GRAPHS[name]
    path, rows = written(tmp_path, make()), spikes(n_inputs, N_STEPS)
    wanted = equations.run(spikeport.nir.load(path, DT_S).folded, {"input": rows})
    exact = played(spikeport.nir.load(path, DT_S), rows, "reference")
    chip = played(spikeport.nir.load(path, DT_S), rows, "native")
    for population, spiked in wanted.items():
        assert 10 < spiked.sum() < spiked.size / 2, population
        np.testing.assert_array_equal(exact[population] > 0, spiked > 0)
        equal = np.mean((chip[population] > 0) == (spiked > 0))
        assert equal > 1 - spiked.mean() / 3, population  # a third of what silence misses


def test_one_synapse_for_each_weight_takes_half_of_them(tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    counts = [
        len(spikeport.compile_network(spikeport.nir.load(path, DT_S, parts=n)).image.synapses)
        for n in (1, 2)
    ]
    assert counts[0] == 6 * 12 + 12 * 12 + 12 * 4
    assert 1.9 < counts[1] / counts[0] <= 2


def test_a_readout_on_the_host_has_its_voltage(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(6, 2)
    values = {"r": np.full(2, 3.0), "v_leak": np.zeros(2), "w_in": np.full(2, 2.0)}
    taus = {"tau_syn": np.full(2, 2e-3), "tau_mem": np.array([5e-3, 9e-3])}
    graph = nir_graphs.graph(
        input=first, a=nir_graphs.affine(rng, 8, 6), hidden=nir_graphs.cuba(8),
        b=nir_graphs.affine(rng, 2, 8), read=nir.CubaLI(**taus, **values), output=last,
    )  # fmt: skip
    path, rows = written(tmp_path, graph), spikes(6)
    wanted = equations.run(spikeport.nir.load(path, DT_S).folded, {"input": rows})
    found = played(spikeport.nir.load(path, DT_S), rows, "native")
    np.testing.assert_array_equal(found["hidden"] > 0, wanted["hidden"] > 0)
    assert np.abs(wanted["read"]).max() > 0.1
    np.testing.assert_allclose(found["read"], wanted["read"], atol=1e-12)


def test_inputs_may_be_connected_too(tmp_path):
    network = spikeport.nir.load(written(tmp_path, nir_graphs.recurrent()), DT_S)
    with network:
        every = nengo.Node(np.ones(6))
        nengo.Connection(every, network.inputs["input"], synapse=None)
        output = nengo.Probe(network.outputs["output"])
    with spikeport.Simulator(network) as sim:
        sim.run_steps(60)
    assert set(np.unique(sim.data[output])) == {0, 1 / DT_S}
