"""Traffic with the host, counted from the image."""

from pathlib import Path

import nengo
import numpy as np
import pytest

from spikeport.compile.image.expected import Rates, expected_activity
from spikeport.compile.image.host_traffic import host_traffic, mean_rate_hz
from spikeport.compile.image.manifest import Encoding
from spikeport.compile.pipeline import compile_network
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.host_io import HostTraffic
from spikeport.simulator import Simulator
from tests.helpers.chip_files import chip_file

DT_S = 0.001
LOIHI = chips.get("loihi")


def network(n: int = 40, dimensions: int = 3) -> nengo.Network:
    with nengo.Network(seed=0) as net:
        values = nengo.Node(lambda t: np.sin(3 * t + np.arange(dimensions)))
        net.neurons = nengo.Ensemble(n, dimensions)
        nengo.Connection(values, net.neurons)
    return net


def test_values_take_a_word_each_and_spikes_a_bit():
    with (net := network(n=70)):
        nengo.Probe(net.neurons, synapse=0.01)  # 3 values, on and off
        nengo.Probe(net.neurons.neurons[:65])  # 65 spikes: 3 words
        nengo.Probe(net.neurons.neurons[:4], attr="voltage")
    found = host_traffic(compile_network(net).image, LOIHI)
    assert found == HostTraffic(
        dt_s=DT_S,
        sources=6,
        spikes=pytest.approx(3.0),
        unknown_sources=0,
        values_back=6 + 4,
        spikes_back=65,
        words_back=(1 + 6 + 4 + 3,),
        errors=0,
    )


def test_spikes_at_uneven_distances_take_a_word_each():
    with (net := network()):
        nengo.Probe(net.neurons.neurons[[0, 1, 5]])
    assert host_traffic(compile_network(net).image, LOIHI).words_back == (1 + 3,)


def test_spikes_of_one_neuron_take_a_word():
    with (net := network()):
        nengo.Probe(net.neurons.neurons[[3]])
    assert host_traffic(compile_network(net).image, LOIHI).words_back == (1 + 1,)


def test_each_chip_sends_the_number_of_the_step_even_if_nothing_on_it_is_read():
    with (net := network(n=800)):
        follower = nengo.Ensemble(800, 3)
        nengo.Connection(net.neurons, follower)
        nengo.Probe(follower.neurons[:10], attr="voltage")
    cores = LOIHI.limits.cores.model_copy(update={"value": 1.0})
    small = LOIHI.model_copy(update={"limits": LOIHI.limits.model_copy(update={"cores": cores})})
    image = compile_network(net).image
    assert image.n_cores == 2
    assert sorted(host_traffic(image, small).words_back) == [1, 1 + 10]


def test_each_piece_of_a_block_sends_its_own_words(tmp_path: Path):
    net = network(n=80)
    with net:
        nengo.Probe(net.neurons.neurons)
    # 4 pieces of 20 neurons on 2 chips: a word for each piece, not 3 for all 80 spikes.
    path = str(chip_file(tmp_path / "small.toml", compartments=20, cores=2, chips=2))
    image = compile_network(net, path).image
    assert image.n_blocks == 4
    assert host_traffic(image, chips.get(path)).words_back == (1 + 2, 1 + 2)


def test_values_of_the_pieces_of_a_block_are_sent_by_their_chips(tmp_path: Path):
    net = network(n=80)
    with net:
        nengo.Probe(net.neurons.neurons[::-1], attr="voltage")
    path = str(chip_file(tmp_path / "small.toml", compartments=20, cores=2, chips=2))
    image = compile_network(net, path).image
    assert host_traffic(image, chips.get(path)).words_back == (1 + 40, 1 + 40)


def test_a_network_without_inputs_and_outputs_sends_no_words():
    with nengo.Network() as net:
        nengo.Ensemble(10, 1)
    assert host_traffic(compile_network(net).image, LOIHI).words_back == ()


def test_one_learning_error_is_sent_for_each_dimension():
    with (net := network(dimensions=2)):
        out = nengo.Node(size_in=2)
        learned = nengo.Connection(net.neurons, out, learning_rule_type=nengo.PES())
        nengo.Connection(out, learned.learning_rule)
    assert host_traffic(compile_network(net).image, LOIHI).errors == 2


def test_rates_of_neurons_on_the_host_count_as_unknown_before_a_run():
    with nengo.Network(seed=0) as net:
        host, chip = (nengo.Ensemble(5, 1) for _ in range(2))
        nengo.Connection(host.neurons, chip.neurons, transform=np.eye(5))
        net.config[nengo.Ensemble].set_param("on_chip", nengo.params.BoolParam("on_chip", True))
        net.config[host].on_chip = False
    image = compile_network(net).image
    found = host_traffic(image, LOIHI)
    assert (found.sources, found.spikes, found.unknown_sources) == (5, 0.0, 5)
    assert expected_activity(image, Rates(100.0)).from_host.total == pytest.approx(0.5)
    assert expected_activity(image, Rates(100.0, {"host": 200.0})).from_host.total == 1.0


@pytest.mark.parametrize(
    ("gain", "bias", "mean_hz"),
    [
        (500.0, 500.0, 500.0),
        (1000.0, 0.0, 250.0),
        (500.0, 0.0, 125.0),
        (2000.0, 0.0, 375.0),  # values from 0.5 on spike in every step
        (0.0, 300.0, 300.0),
        (0.0, 3000.0, 1000.0),
    ],
)
def test_the_mean_rate_is_that_of_values_spread_evenly_from_minus_1_to_1(gain, bias, mean_hz):
    encoding = Encoding("on_off", gain, bias)
    assert mean_rate_hz(encoding, DT_S) == pytest.approx(mean_hz)
    values = np.linspace(-1, 1, 20001)
    assert np.clip(gain * values + bias, 0, 1000).mean() == pytest.approx(mean_hz, rel=1e-3)


@pytest.mark.parametrize("backend", ["native", "nengo-loihi"])
def test_spikes_counted_in_a_run_are_those_that_the_host_sends(backend):
    """Each dimension sends a spike in a step on average, whatever its value."""
    with Simulator(network(), backend=backend) as sim:
        sim.run_steps(200)
        sent = sim.activity.from_host
        report = sim.report()["host_io"]
    assert sent.total == report["spikes"] * 200 == sim.activity.totals()["host_spikes"]
    assert sent.mean == pytest.approx(3.0, abs=0.05)
    assert report["most_spikes"] == sent.most <= 6
    assert report["counted"]
