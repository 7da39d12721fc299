"""Networks of graphs: in float, NIR's equations spike for spike; on the chip, close to them."""

import nengo
import nir
import numpy as np
import pytest
from scipy import sparse

import spikeport
import spikeport.nir
from spikeport.compile.check.violation import DoesNotFitError
from spikeport.networks.loading.nir import equations
from spikeport.networks.loading.nir import network as network_module
from spikeport.networks.loading.nir.network import ONE_PART, SMALLER, NirNetwork
from tests.helpers import nir_graphs
from tests.helpers.chip_files import chip_file
from tests.helpers.nir_graphs import DT_S, spikes, written
from tests.helpers.nir_referee import Referee

N_STEPS = 150
GRAPHS = {
    "recurrent": (lambda: nir_graphs.recurrent(), 6),
    "recurrent with biases": (lambda: nir_graphs.recurrent(bias=0.3), 6),
    "convolutional": (nir_graphs.convolutional, 72),
    "nested": (nir_graphs.nested, 5),
}


def played(network: NirNetwork, rows: np.ndarray, backend: str) -> dict[str, np.ndarray]:
    """Return the outputs of a network's populations, from the step in which input reaches them."""
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
        # Silence would miss all spikes; the chip may miss a third as many.
        assert equal > 1 - spiked.mean() / 3, population


def shaped(edges: str) -> nir.NIRGraph:
    """Return a graph of the populations in some edges, of which c is read."""
    rng, (first, last) = np.random.default_rng(5), nir_graphs.ends(6, 6)
    nodes = {"input": first, "output": last}
    nodes |= {name: nir_graphs.lif(6) for name in "abcd" if name in edges}
    pairs = [edge.split(">") for edge in edges.split()]
    weights = {f"w{n}": nir.Linear(rng.normal(0.3, 0.4, (6, 6))) for n in range(len(pairs))}
    wires = [wire for n, (a, b) in enumerate(pairs) for wire in (f"{a}>w{n}", f"w{n}>{b}")]
    return nir_graphs.wired(nodes | weights, " ".join([*wires, "c>output"]))


@pytest.mark.parametrize(
    ("edges", "exact"),
    [
        ("input>a a>b b>c", True),
        ("input>a a>b b>c b>b", True),
        ("input>a a>b b>c input>c", True),
        ("input>a input>b a>c b>c", True),
        ("input>a a>b b>c a>c", False),
        ("input>a input>b b>d a>c d>c", False),
        ("input>a a>b b>a b>c", False),
    ],
)
def test_in_float_graphs_are_exact_unless_they_skip_populations_or_cycle_through_several(
    tmp_path, edges, exact
):
    path, rows = written(tmp_path, shaped(edges)), spikes(6, N_STEPS)
    network = spikeport.nir.load(path, DT_S)
    wanted = equations.run(network.folded, {"input": rows})
    found = played(network, rows, "reference")
    assert all(spiked.sum() > 10 for spiked in wanted.values())
    equal = [np.array_equal(found[name] > 0, spiked > 0) for name, spiked in wanted.items()]
    assert all(equal) == exact
    texts = [text for _, text in spikeport.nir.differences(network) if " arrive " in text]
    assert (not texts) == exact


def test_one_synapse_for_each_weight_takes_half_the_synapses_of_two(tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    counts = [
        len(spikeport.compile_network(spikeport.nir.load(path, DT_S, parts=n)).image.synapses)
        for n in (1, 2)
    ]
    assert counts[0] == 6 * 12 + 12 * 12 + 12 * 4
    assert 1.9 < counts[1] / counts[0] <= 2


@pytest.mark.parametrize(("parts", "most", "cure"), [(2, 20, ONE_PART), (1, 8, SMALLER)])
def test_a_graph_that_is_too_large_names_the_parts_that_help(tmp_path, parts, most, cure):
    path = written(tmp_path, nir_graphs.recurrent())
    chip = chip_file(tmp_path / "small.toml", in_axons=most)
    with pytest.raises(DoesNotFitError) as raised:
        spikeport.compile_network(spikeport.nir.load(path, DT_S, parts=parts), chip)
    assert {one.cure for one in raised.value.violations} == {cure}
    assert "compact" not in str(raised.value)
    if cure == ONE_PART:
        spikeport.compile_network(spikeport.nir.load(path, DT_S, parts=1), chip)


def test_a_readout_on_the_host_has_the_voltage_of_the_chips_spikes(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(6, 2)
    values = {"r": np.full(2, 3.0), "v_leak": np.zeros(2), "w_in": np.full(2, 2.0)}
    taus = {"tau_syn": np.full(2, 2e-3), "tau_mem": np.array([5e-3, 9e-3])}
    graph = nir_graphs.graph(
        input=first, a=nir_graphs.affine(rng, 8, 6), hidden=nir_graphs.cuba(8),
        b=nir_graphs.affine(rng, 2, 8), read=nir.CubaLI(**taus, **values), output=last,
    )  # fmt: skip
    path, rows = written(tmp_path, graph), spikes(6)
    found = played(spikeport.nir.load(path, DT_S), rows, "native")
    of = spikeport.nir.load(path, DT_S).folded.populations["read"]
    current, voltage, wanted = np.zeros(2), np.zeros(2), []
    for spiked in found["hidden"] > 0:
        current = current * (1 - DT_S / taus["tau_syn"]) + of.dynamics.gain * (
            graph.nodes["b"].weight @ spiked
        )
        voltage = voltage * (1 - DT_S / taus["tau_mem"]) + current
        wanted.append(voltage)
    assert np.abs(wanted).max() > 0.1
    np.testing.assert_allclose(found["read"], wanted, atol=1e-12)


def biased_skips() -> nir.NIRGraph:
    """Return neurons with biases, leaks and reset voltages, and inputs of neurons at two depths."""
    rng = np.random.default_rng(4)
    first, last = nir_graphs.ends(6, 5)
    resting = {"v_reset": -0.5, "v_leak": 0.4}
    nodes = {
        "input": first,
        "w": nir_graphs.affine(rng, 8, 6, bias=0.2),
        "a": nir_graphs.cuba(8, **resting),
    }
    nodes |= {"v": nir_graphs.affine(rng, 5, 8), "u": nir_graphs.affine(rng, 5, 6, bias=0.1)}
    nodes |= {"b": nir_graphs.cuba(5, v_reset=0.25, v_leak=-0.2, w_in=20.0), "output": last}
    edges = [("input", "w"), ("w", "a"), ("a", "v"), ("v", "b"), ("input", "u"), ("u", "b")]
    return nir.NIRGraph(nodes, [*edges, ("b", "output")], type_check=False)


def test_float_spikes_as_nir_does_from_the_first_step_on(tmp_path):
    path, rows = written(tmp_path, biased_skips()), spikes(6, N_STEPS)
    wanted = Referee(biased_skips(), DT_S).run({"input": rows})
    exact, chip = (played(spikeport.nir.load(path, DT_S), rows, b) for b in ("reference", "native"))
    for name in ("a", "b"):
        assert wanted[name].sum() > 20
        np.testing.assert_array_equal(exact[name] > 0, wanted[name] > 0)
        assert np.mean((chip[name] > 0) == (wanted[name] > 0)) > 0.99


def test_long_time_constants_cost_little(tmp_path):
    rng = np.random.default_rng(0)
    first, last = nir_graphs.ends(20, 30)
    graph = nir_graphs.graph(
        input=first, w=nir_graphs.affine(rng, 30, 20), n=nir_graphs.lif(30, tau=6.1), output=last
    )
    path, rows = written(tmp_path, graph), spikes(20, 300)
    wanted = equations.run(spikeport.nir.load(path, DT_S).folded, {"input": rows})["n"]
    found = played(spikeport.nir.load(path, DT_S), rows, "native")["n"]
    assert 0.01 < wanted.mean() < 0.2
    # 12 bits represent the decay only to within 50 %.
    assert np.mean((found > 0) == (wanted > 0)) > 0.995


def test_an_input_that_just_reaches_the_threshold_makes_no_spike_on_the_chip(tmp_path):
    first, last = nir_graphs.ends(4, 4)
    path = written(tmp_path, nir_graphs.graph(input=first, n=nir_graphs.lif(4), output=last))
    assert not played(spikeport.nir.load(path, DT_S), np.eye(4), "native")["n"].any()


def test_an_image_has_the_outputs_of_its_graph(tmp_path):
    path = written(tmp_path, nir_graphs.recurrent())
    image = spikeport.compile_network(spikeport.nir.load(path, DT_S)).image
    assert [(one.name, one.size) for one in image.manifest.outputs] == [("read -> output", 4)]


def test_sparse_matrices_of_large_readouts_compute_what_dense_ones_do(tmp_path, monkeypatch):
    path, rows = written(tmp_path, nir_graphs.nested()), spikes(5)
    found = {}
    for limit in (network_module.WHOLE, 0):
        monkeypatch.setattr(network_module, "WHOLE", limit)
        network = spikeport.nir.load(path, DT_S)
        with network:
            scaled = nengo.Node(size_in=4)
            network_module._to_host(network.populations["gate"], scaled, sparse.eye_array(4) * 3)
            probe = nengo.Probe(scaled)
        network.feeds["input"].play(rows, DT_S)
        with spikeport.Simulator(network) as sim:
            sim.run_steps(60)
            found[limit] = np.array(sim.data[probe])
    one, other = found.values()
    assert one.any()
    np.testing.assert_array_equal(one, other)


def test_nengo_nodes_may_be_connected_to_inputs(tmp_path):
    network = spikeport.nir.load(written(tmp_path, nir_graphs.recurrent()), DT_S)
    with network:
        every = nengo.Node(np.ones(6))
        nengo.Connection(every, network.inputs["input"], synapse=None)
        output = nengo.Probe(network.outputs["output"])
    with spikeport.Simulator(network) as sim:
        sim.run_steps(60)
    assert set(np.unique(sim.data[output])) == {0, 1 / DT_S}


@pytest.mark.parametrize("passes", ["as_written", "compact"])
def test_a_graph_may_be_a_part_of_a_larger_network(tmp_path, passes):
    """Play the same spikes into a graph by itself, and into one beside ensembles of Nengo's."""
    path, rows = written(tmp_path, nir_graphs.recurrent(bias=0.3)), spikes(6, N_STEPS)
    alone = read(spikeport.nir.load(path, DT_S), rows, "native")
    with nengo.Network(seed=1) as network:
        graph = spikeport.nir.load(path, DT_S)
        graph.feeds["input"].play(rows, DT_S)
        output = nengo.Probe(graph.outputs["output"])
        count = nengo.Ensemble(60, 1, radius=2, label="count")
        total = np.full((1, graph.outputs["output"].size_out), DT_S)
        nengo.Connection(graph.outputs["output"], count, transform=total)
        nengo.Connection(count, nengo.Ensemble(50, 1))
    with spikeport.Simulator(network, pipeline=passes) as sim:
        sim.run_steps(len(rows))
        np.testing.assert_array_equal(sim.data[output], alone)
        assert any("count" in block.label for block in sim.image.manifest.blocks)


def read(network: NirNetwork, rows: np.ndarray, backend: str) -> np.ndarray:
    """Return the output of a network in each step."""
    network.feeds["input"].play(rows, DT_S)
    with network:
        probe = nengo.Probe(network.outputs["output"])
    with spikeport.Simulator(network, backend=backend) as sim:
        sim.run_steps(len(rows))
        return np.array(sim.data[probe])


def test_a_bias_before_an_output_is_in_the_unit_of_spikes(tmp_path):
    first, last = nir_graphs.ends(1, 1)
    graph = nir_graphs.graph(
        input=first,
        a=nir.Threshold(threshold=np.array([0.5])),
        w=nir.Affine(weight=np.array([[2.0]]), bias=np.array([3.0])),
        output=last,
    )
    path, rows = written(tmp_path, graph), np.array([[0.0, 1, 0, 1, 0, 0]]).T
    wanted = 2 * rows[:-2, 0] + 3
    for backend in ("reference", "native"):
        found = read(spikeport.nir.load(path, DT_S), rows, backend)[:, 0] * DT_S
        late = 1 if backend == "reference" else 2
        np.testing.assert_allclose(found[late:][:4], wanted)


def test_a_bias_behind_a_readout_is_in_the_unit_of_its_voltage(tmp_path):
    first, last = nir_graphs.ends(1, 1)
    values = {name: np.ones(1) for name in ("tau", "r")}
    graph = nir_graphs.graph(
        input=first,
        a=nir.Threshold(threshold=np.array([0.5])),
        r=nir.LI(**values, v_leak=np.zeros(1)),
        w=nir.Affine(weight=np.array([[2.0]]), bias=np.array([3.0])),
        output=last,
    )
    found = read(spikeport.nir.load(written(tmp_path, graph), DT_S), np.zeros((5, 1)), "native")
    np.testing.assert_allclose(found, 3)
