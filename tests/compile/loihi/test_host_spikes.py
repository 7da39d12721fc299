"""The most spikes that ensembles on the host can send to the chip in a step."""

from pathlib import Path

import nengo
import nengo_loihi
import numpy as np

from spikeport.compile.ground.names import Names
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.loihi.build import build
from spikeport.compile.loihi.host_spikes import host_spikes
from tests.helpers.event_files import camera_network, process_of, random_events, write_events


def test_a_value_sends_at_most_two_spikes_a_step_and_a_neuron_one() -> None:
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        host, idle, chip = nengo.Ensemble(9, 2), nengo.Ensemble(3, 1), nengo.Ensemble(5, 2)
        network.config[host].on_chip = network.config[idle].on_chip = False
        nengo.Connection(host, chip)
        nengo.Connection(host.neurons, chip.neurons, transform=np.ones((5, 9)))
        nengo.Connection(nengo.Node([1, 1]), chip)  # spikes of a node do not count
    counts = host_spikes(build(Rewrite(network, Names(network)), 0.001).model)
    assert (counts[host], counts[idle]) == (2 * 2 + 9, 0)


def test_values_that_pass_through_nodes_are_counted_where_they_enter_the_chip() -> None:
    with nengo.Network(seed=1) as network:
        nengo_loihi.add_params(network)
        host = nengo.Ensemble(9, 3)
        network.config[host].on_chip = False
        first, second = nengo.Node(size_in=3), nengo.Node(size_in=1)
        computed = nengo.Node(lambda t, x: x, size_in=3)
        nengo.Connection(host, first)
        nengo.Connection(first[:1], second)
        nengo.Connection(first, computed)
        for node in (second, computed):
            nengo.Connection(node, nengo.Ensemble(5, node.size_out))
    counts = host_spikes(build(Rewrite(network, Names(network)), 0.001).model)
    assert counts == {host: 2}


def test_spikes_of_a_camera_do_not_count_for_an_ensemble(tmp_path: Path) -> None:
    path = write_events(tmp_path / "few.events", **random_events(20, 5000))
    network = camera_network(process_of(path))
    with network:
        nengo_loihi.add_params(network)
        host = nengo.Ensemble(9, 1)
        network.config[host].on_chip = False
        nengo.Connection(host, nengo.Ensemble(5, 1))
    counts = host_spikes(build(Rewrite(network, Names(network)), 0.001).model)
    assert counts == {host: 2}
