"""The README's table of features: each row is a network that compiles, or is refused as it says."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import nengo
import nengo_loihi
import nengo_spa as spa
import numpy as np
import pytest

import spikeport
from spikeport.errors import DoesNotFitError, UsageError
from tests.helpers.event_files import camera_network, process_of, random_events, write_events

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
HEAD = "| of Nengo and nengo-loihi | spikeport |\n|---|---|\n"
ROWS = dict(
    re.findall(r"^\| (.*) \| (.*) \|$", README.partition(HEAD)[2].partition("\n\n")[0], re.M)
)
pytestmark = pytest.mark.filterwarnings("ignore")


class LiveCamera(nengo_loihi.dvs.DVSFileChipProcess):
    """Stand-in for a live camera, whose events are in no file."""


def neurons_of_the_chip() -> None:
    kinds = (nengo.LIF(), nengo.SpikingRectifiedLinear(), nengo.RegularSpiking(nengo.LIFRate()))
    for kind in kinds:
        nengo.Ensemble(10, 1, neuron_type=kind)


def rate_neurons() -> None:
    nengo.Ensemble(10, 1, neuron_type=nengo.LIFRate())


def decoded() -> None:
    ensemble = nengo.Ensemble(30, 2)
    nengo.Connection(nengo.Node([0.5]), ensemble, transform=[[1], [0.5]])
    nengo.Connection(ensemble, ensemble, function=lambda x: x * 0.5, synapse=0.1)


def between_neurons() -> None:
    a, b = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    nengo.Connection(a.neurons, b.neurons, transform=np.full((10, 10), 0.01))
    sparse = nengo.Sparse((10, 10), indices=[(0, 1), (3, 2)], init=[0.01, 0.02])
    nengo.Connection(a.neurons, b.neurons, transform=sparse)


def from_host_neurons(kind: nengo.neurons.NeuronType) -> None:
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    a, b = nengo.Ensemble(10, 1, neuron_type=kind), nengo.Ensemble(10, 1)
    network.config[a].on_chip = False
    nengo.Connection(a.neurons, b.neurons, transform=0.01)


def slices() -> None:
    a, b = nengo.Ensemble(20, 2), nengo.Ensemble(20, 2)
    nengo.Connection(a[0], b[1])


def convolution() -> None:
    transform = nengo.Convolution(4, (6, 6, 1), init=nengo.dists.Uniform(0, 0.1))
    alike = {"gain": nengo.dists.Choice([100]), "bias": nengo.dists.Choice([0])}
    image = nengo.Ensemble(36, 1)
    features = nengo.Ensemble(transform.output_shape.size, 1, **alike)
    connection = nengo.Connection(image.neurons, features.neurons, transform=transform)
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    network.config[connection].pop_type = 16
    network.config[features].block_shape = nengo_loihi.BlockShape((2, 2, 4), (4, 4, 4))


def low_pass() -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Connection(a, nengo.Ensemble(20, 1), synapse=nengo.Lowpass(0.03))


def alpha_of_the_host() -> None:
    a = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node([0.5]), a, synapse=nengo.Alpha(0.03))
    nengo.Probe(a, synapse=nengo.Alpha(0.03))


def alpha_on_the_chip() -> None:
    nengo.Connection(nengo.Ensemble(20, 1), nengo.Ensemble(20, 1), synapse=nengo.Alpha(0.03))


def pes() -> None:
    pre, post = nengo.Ensemble(20, 1), nengo.Node(size_in=1)
    error = nengo.Node(lambda t, x: x, size_in=1)
    connection = nengo.Connection(pre, post, learning_rule_type=nengo.PES(), function=lambda x: 0)
    nengo.Connection(post, error)
    nengo.Connection(error, connection.learning_rule)


def noise() -> None:
    nengo.Ensemble(10, 1, noise=nengo.processes.WhiteNoise())


def nodes() -> None:
    ensemble = nengo.Ensemble(20, 1)
    nengo.Connection(nengo.Node(lambda t: np.sin(t)), ensemble)
    nengo.Connection(nengo.Node(nengo.processes.WhiteSignal(1.0, 5, seed=0)), ensemble)
    nengo.Connection(ensemble, nengo.Node(lambda t, x: x, size_in=1))


def probes() -> None:
    ensemble = nengo.Ensemble(20, 1)
    nengo.Probe(ensemble, synapse=0.01)
    for attribute in ("output", "voltage", "input"):
        nengo.Probe(ensemble.neurons, attribute)


def refractory_probe() -> None:
    nengo.Probe(nengo.Ensemble(20, 1).neurons, "refractory_time")


def libraries() -> None:
    nengo.networks.EnsembleArray(10, 3)
    spa.State(16, neurons_per_dimension=5)


def rate_neurons_of_the_host() -> None:
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    network.config[nengo.Ensemble(10, 1, neuron_type=nengo.LIFRate())].on_chip = False
    nengo.Ensemble(10, 1)


def oja(on_chip: bool) -> None:
    network = nengo.Network.context[-1]
    spikeport.add_params(network)
    pre, post = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    rule = nengo.Oja()
    nengo.Connection(pre, post, solver=nengo.solvers.LstsqL2(weights=True), learning_rule_type=rule)
    for ensemble in (pre, post):
        network.config[ensemble].on_chip = on_chip
    nengo.Ensemble(10, 1)


def pes_to_neurons() -> None:
    pre, post = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
    nengo.Connection(pre, post.neurons, transform=np.zeros((10, 1)), learning_rule_type=nengo.PES())


def live_camera() -> None:
    nengo.Connection(nengo.Node(LiveCamera("camera.aedat"))[:4], nengo.Ensemble(4, 1).neurons)


CASES: list[tuple[str, Callable[[], None], str | None]] = [
    (
        "`LIF`, `SpikingRectifiedLinear`, `RegularSpiking` of `LIFRate` or `RectifiedLinear`",
        neurons_of_the_chip,
        None,
    ),
    ("rate neurons, other neuron types", rate_neurons_of_the_host, None),
    ("rate neurons, other neuron types", rate_neurons, "SP002"),
    ("decoded connections: functions, transforms, recurrence", decoded, None),
    ("connections between neurons, dense and `Sparse`", between_neurons, None),
    (
        "connections from neurons on the host to the chip",
        partial(from_host_neurons, nengo.LIF()),
        None,
    ),
    (
        "connections from neurons on the host to the chip",
        partial(from_host_neurons, nengo.LIFRate()),
        "SP015",
    ),
    ("slices as sources and as targets", slices, None),
    ("`Convolution`, `pop_type`, `block_shape`", convolution, None),
    ("first-order low-pass synapses", low_pass, None),
    ("other synapses", alpha_of_the_host, None),
    ("other synapses", alpha_on_the_chip, "SP005"),
    ("PES", pes, None),
    ("PES", pes_to_neurons, "SP016"),
    ("learning rules other than PES", partial(oja, on_chip=False), None),
    ("learning rules other than PES", partial(oja, on_chip=True), "SP007"),
    ("noise of ensembles", noise, "SP003"),
    ("nodes: functions, processes, environments", nodes, None),
    ("probes of values; of spikes, voltages, inputs of neurons", probes, None),
    ("probes of other things in an ensemble", refractory_probe, "SP010"),
    ("`nengo.networks`, `nengo_spa`", libraries, None),
    ("live DVS cameras", live_camera, "SP009"),
]
OTHERS = {
    "`on_chip`, `set_defaults`, `dt`, `seed`, `reset`",
    "files of DVS events",
    "SNIPs and `hardware_options`",
}


def test_every_row_has_a_test() -> None:
    assert set(ROWS) == {row for row, *_ in CASES} | OTHERS


@pytest.mark.parametrize(("row", "make", "rule"), CASES)
def test_a_feature_compiles_or_is_refused_as_its_row_says(
    row: str, make: Callable[[], None], rule: str | None
) -> None:
    with nengo.Network(seed=1) as network:
        make()
    if rule is None:
        assert re.search("yes|on the host|from and to the host", ROWS[row])
        spikeport.compile_network(network)
        return
    assert rule in ROWS[row]
    with pytest.raises(DoesNotFitError, match=rule):
        spikeport.compile_network(network)


@pytest.mark.usefixtures("nengo_defaults")
def test_settings_and_options_of_a_simulator_are_accepted() -> None:
    assert "yes" in ROWS["`on_chip`, `set_defaults`, `dt`, `seed`, `reset`"]
    spikeport.set_defaults()
    with nengo.Network() as network:
        spikeport.add_params(network)
        host, chip = nengo.Ensemble(10, 1), nengo.Ensemble(10, 1)
        network.config[host].on_chip = False
        nengo.Connection(host, chip)
        probe = nengo.Probe(chip)
    with spikeport.Simulator(network, dt=0.002, seed=3, progress_bar=False) as sim:
        sim.run_steps(20)
        first = sim.data[probe].copy()
        sim.reset()
        sim.run_steps(20)
        np.testing.assert_array_equal(sim.data[probe], first)


def test_a_network_with_a_file_of_events_compiles(tmp_path: Path) -> None:
    assert ROWS["files of DVS events"] == "yes"
    path = write_events(tmp_path / "a.events", **random_events(50, 5_000))
    spikeport.compile_network(camera_network(process_of(path)))


def test_options_of_hardware_are_refused() -> None:
    assert "refused" in ROWS["SNIPs and `hardware_options`"]
    with pytest.raises(UsageError, match="hardware_options"):
        spikeport.Simulator(nengo.Network(), hardware_options={"snip_max_spikes_per_step": 50})


@pytest.mark.parametrize("passes", ["as_written", "compact"])
def test_passthrough_nodes_can_be_probed_even_if_they_lead_nowhere(passes: str) -> None:
    with nengo.Network(seed=1) as network:
        array, out = nengo.networks.EnsembleArray(20, 2), nengo.Node(size_in=1)
        nengo.Connection(array.output, array.input, synapse=0.1)
        nengo.Connection(array.output, out, transform=[[1, 1]], synapse=None)
        nengo.Probe(out, synapse=0.01)
    spikeport.compile_network(network, pipeline=passes)
