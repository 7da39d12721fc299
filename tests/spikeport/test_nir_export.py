"""Images as NIR graphs, whose equations give the chip's spikes if decays are the chip's."""

import nengo
import nir
import numpy as np
import pytest

import spikeport
import spikeport.nir
from spikeport import nir_export
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import part
from spikeport.errors import UsageError
from spikeport.experiments.policy.conversion import Conversion, convert
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.nir.equations import run
from spikeport.networks.policy import Layer, PolicyOptions
from spikeport.nir_export import export
from tests.helpers import nir_graphs
from tests.helpers.full_disk import largest_file
from tests.helpers.nir_graphs import DT_S
from tests.helpers.nir_referee import Referee

N_STEPS = 120
RATES = nengo.dists.Uniform(100, 200)


def native(image: ChipImage, rows: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return spikes of compartments, (n_steps, n), and their voltages, for spikes of the host."""
    chip = NativeChip(image, seed=0)
    counts, voltages = [np.zeros(image.n_compartments, dtype=int)], []
    for row in rows:
        chip.step(np.flatnonzero(row), {})
        counts.append(np.array(chip.state.spike_count))
        voltages.append(np.array(chip.state.v))
    return np.diff(counts, axis=0), voltages


def assert_spikes_are_native(image: ChipImage, folder, share: float) -> int:
    """Export an image, assert that chip and graph spike alike, and return the number of spikes."""
    path = folder / "image.nir"
    export(image, path)
    graph = nir.read(path, type_check=False)
    rows = nir_graphs.spikes(image.n_inputs, N_STEPS, share)
    wanted, _ = native(image, rows)
    ends = np.cumsum(image.inputs.size)[:-1]
    inputs = {f"input{i}": each for i, each in enumerate(np.split(rows, ends, axis=1))}
    found = Referee(graph, image.manifest.dt_s, chip=True).run(inputs)
    for block in range(image.n_blocks):
        mine = wanted[:, part(image.blocks.start, block)]
        if isinstance(graph.nodes[f"block{block}"], nir.CubaLI):
            assert not mine.any()  # a read-out stays below its threshold
        else:
            np.testing.assert_array_equal(found[f"block{block}"], mine)
    return int(wanted.sum())


def test_a_full_disk_leaves_the_earlier_file(tmp_path):
    path = nir_graphs.written(tmp_path, nir_graphs.recurrent(0.0))
    image = spikeport.compile_network(spikeport.nir.load(path, DT_S)).image
    earlier = path.read_bytes()
    with largest_file(1000), pytest.raises(OSError, match="File too large") as error:
        export(image, path)
    assert error.value.filename == str(path)
    assert path.read_bytes() == earlier
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("bias", [0.0, 0.3])
def test_an_imported_graph_is_exported_with_the_same_spikes(tmp_path, bias):
    path = nir_graphs.written(tmp_path, nir_graphs.recurrent(bias))
    image = spikeport.compile_network(spikeport.nir.load(path, DT_S)).image
    assert assert_spikes_are_native(image, tmp_path, 0.3) > 100


def network() -> nengo.Network:
    with nengo.Network(seed=1) as net:
        u = nengo.Node([0.5])
        a = nengo.Ensemble(40, 1, neuron_type=nengo.LIF(tau_ref=0.004), max_rates=RATES, label="a")
        b = nengo.Ensemble(30, 1, neuron_type=nengo.SpikingRectifiedLinear(), label="b")
        nengo.Connection(u, a)
        nengo.Connection(a, b)
        nengo.Probe(b, synapse=0.01)
    return net


@pytest.mark.parametrize("pipeline", ["as_written", "compact"])
def test_refractory_times_floors_and_decode_neurons_are_exported_with_the_same_spikes(
    tmp_path, pipeline
):
    image = spikeport.compile_network(network(), pipeline=pipeline).image
    assert assert_spikes_are_native(image, tmp_path, 0.5) > 100


@pytest.mark.slow
def test_a_converted_policy_is_exported_with_the_same_spikes(tmp_path):
    rng = np.random.default_rng(0)
    sizes = [(3, 2), (1, 3)]
    layers = tuple(Layer(rng.normal(0, 0.7, size), np.zeros(size[0])) for size in sizes)
    conversion = Conversion(Mlp(layers, "elu"), PolicyOptions(10), rng.normal(0, 1, (20, 2)))
    image = convert(conversion, "loihi", "compact", lambda *_: None).compilation.image
    assert assert_spikes_are_native(image, tmp_path, 0.3) > 100


def test_metadata_hold_the_values_that_nir_has_no_field_for(tmp_path):
    image = spikeport.compile_network(network()).image
    export(image, tmp_path / "image.nir")
    graph = nir.read(tmp_path / "image.nir", type_check=False)
    assert graph.metadata["image"] == image.digest
    assert graph.metadata["dt"] == DT_S
    a = graph.nodes["block0"]
    assert a.metadata["label"] == "a"
    assert a.metadata["v_min"] == 0
    assert set(a.metadata["rest_steps"]) == {4}
    assert set(np.concatenate([a.v_threshold % 64, a.v_reset])) == {0}
    assert graph.nodes["input0"].metadata["label"] == image.manifest.inputs[0].name
    assert [node.size for node in image.manifest.inputs] == [
        int(node.input_type["input"][0])
        for node in graph.nodes.values()
        if isinstance(node, nir.Input)
    ]


def test_an_exported_graph_is_loaded_with_the_same_spikes_but_for_voltage_floors(tmp_path):
    path = nir_graphs.written(tmp_path, nir_graphs.recurrent(bias=0.3))
    image = spikeport.compile_network(spikeport.nir.load(path, DT_S)).image
    export(image, tmp_path / "image.nir")
    again = spikeport.nir.load(tmp_path / "image.nir", DT_S)
    assert len(again.outputs) == 1
    rows = nir_graphs.spikes(image.n_inputs, N_STEPS, 0.3)
    ends = np.cumsum(image.inputs.size)[:-1]
    inputs = {f"input{i}": each for i, each in enumerate(np.split(rows, ends, axis=1))}
    graph = nir.read(tmp_path / "image.nir", type_check=False)
    neurons = [node for node in graph.nodes.values() if isinstance(node, nir.CubaLIF)]
    # The chip limits voltages to the width of a register, for which NIR has no field.
    for node in neurons:
        node.metadata["v_min"] = -np.inf
    wanted = Referee(graph, image.manifest.dt_s, chip=True).run(inputs)["block0"]
    found = run(again.folded, inputs)["block0"]
    assert wanted.sum() > 100
    np.testing.assert_array_equal(found[:-1], wanted[1:])  # a step later, which an edge takes


def test_a_readout_has_the_chips_voltages_and_a_weight_to_its_output(tmp_path):
    image = spikeport.compile_network(network()).image
    export(image, tmp_path / "image.nir")
    graph = nir.read(tmp_path / "image.nir", type_check=False)
    rows = nir_graphs.spikes(image.n_inputs, N_STEPS, 0.5)
    _, voltages = native(image, rows)
    found = Referee(graph, DT_S, chip=True).run({"input0": rows})
    (block,) = (k for k, n in graph.nodes.items() if isinstance(n, nir.CubaLI))
    mine = part(image.blocks.start, int(block.removeprefix("block")))
    np.testing.assert_array_equal(found[block], np.array(voltages)[:, mine])
    assert graph.nodes[f"output0_{block}"].weight.any()


def test_learning_is_refused(tmp_path):
    with nengo.Network(seed=0) as net:
        pupil, error = nengo.Ensemble(20, 1), nengo.Node(lambda t, x: x, size_in=1)
        nengo.Connection(nengo.Node([0.5]), pupil)
        learned = nengo.Connection(pupil, error, learning_rule_type=nengo.PES())
        nengo.Connection(error, learned.learning_rule)
    image = spikeport.compile_network(net).image
    with pytest.raises(UsageError) as caught:
        export(image, tmp_path / "image.nir")
    assert str(caught.value) == (
        f"image {image.digest[:12]} learns, which NIR cannot express; cure: compile the network "
        "without it"
    )
    assert not (tmp_path / "image.nir").exists()


@pytest.mark.parametrize(("read", "key"), [("voltage", "voltage"), ("input", "current")])
def test_outputs_that_read_registers_are_refused(tmp_path, read, key):
    with nengo.Network(seed=0) as net:
        ensemble = nengo.Ensemble(20, 1)
        nengo.Probe(ensemble.neurons, read)
    image = spikeport.compile_network(net).image
    with pytest.raises(UsageError) as caught:
        export(image, tmp_path / "image.nir")
    (entry,) = image.manifest.outputs
    assert str(caught.value) == (
        f"image {image.digest[:12]}: output '{entry.name}' reads a {key}, which NIR cannot "
        "express; cure: probe spikes or values"
    )
    assert not (tmp_path / "image.nir").exists()


def test_an_image_of_too_large_matrices_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(nir_export, "ENTRIES", 10)
    image = spikeport.compile_network(network()).image
    with pytest.raises(UsageError) as caught:
        export(image, tmp_path / "image.nir")
    assert str(caught.value) == (
        f"image {image.digest[:12]}: its matrices have more than 10 entries, zeros among them; "
        "cure: compile it without the pass fuse, or probe fewer neurons"
    )
    assert not (tmp_path / "image.nir").exists()


def spikes_of(order: list[int]) -> ChipImage:
    with nengo.Network(seed=1) as net:
        ensemble = nengo.Ensemble(40, 1, max_rates=RATES)
        nengo.Probe(ensemble.neurons[order])
    return spikeport.compile_network(net).image


def test_matrices_of_outputs_count_as_well(tmp_path, monkeypatch):
    monkeypatch.setattr(nir_export, "ENTRIES", 79)
    with pytest.raises(UsageError, match="its matrices have more than 79 entries"):
        export(spikes_of([5, 3]), tmp_path / "image.nir")
    monkeypatch.setattr(nir_export, "ENTRIES", 80)
    export(spikes_of([5, 3]), tmp_path / "image.nir")


def test_the_values_of_an_output_of_spikes_are_those_of_its_neurons(tmp_path):
    image = spikes_of([5, 3])
    export(image, tmp_path / "image.nir")
    (entry,) = image.manifest.outputs
    scale = image.decoders.weight[0] if entry.weights == "scale" else 1
    wanted = np.zeros((2, 40))
    wanted[[0, 1], [5, 3]] = scale
    graph = nir.read(tmp_path / "image.nir", type_check=False)
    np.testing.assert_array_equal(graph.nodes["output0_block0"].weight, wanted)
