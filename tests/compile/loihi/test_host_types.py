"""Neurons for the host by their type: no setting of the network is read, or changed."""

import threading

import nengo
import numpy as np
from nengo_loihi.splitter import HostChipSplit

from spikeport.compile.ground.identity import identity
from spikeport.compile.loihi.host_types import host_types_stay
from spikeport.compile.pipeline import compile_network
from spikeport.neurons import SpikeSource


def network() -> nengo.Network:
    """Return neurons for the host that feed neurons on the chip, both in a subnetwork."""
    with nengo.Network(seed=0) as outer, nengo.Network():
        source = nengo.Ensemble(4, 1, neuron_type=SpikeSource(), gain=np.ones(4), bias=np.ones(4))
        target = nengo.Ensemble(6, 1, label="target")
        weights = np.full((6, 4), 1e-3)
        nengo.Connection(source.neurons, target.neurons, transform=weights, synapse=0.005)
    return outer


def test_neurons_for_the_host_stay_there_in_a_subnetwork() -> None:
    outer = network()
    before = identity(outer)
    assert compile_network(outer).image.n_compartments == 6
    assert identity(outer) == before


def test_two_threads_may_compile_one_network() -> None:
    outer, digests = network(), []
    threads = [
        threading.Thread(target=lambda: digests.append(compile_network(outer).image.digest))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(digests) == 2
    assert len(set(digests)) == 1


def test_nengo_loihis_placing_of_ensembles_is_restored_after_the_context() -> None:
    usual = HostChipSplit._place_ensembles
    with host_types_stay():
        assert HostChipSplit._place_ensembles is not usual
    assert HostChipSplit._place_ensembles is usual
