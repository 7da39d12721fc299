"""Spikes of the host that did not fit into a step."""

from dataclasses import replace

import nengo
import numpy as np

from spikeport.backends.lost_spikes import LostSpikes
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network

ONE = 1000.0
"""The output of a source that spikes once in a step of 1 ms."""


def image_of(value: float | list[float]) -> ChipImage:
    """Return the image of a network with an input of values, and one of spikes."""
    with nengo.Network(seed=0) as network:
        network.config[nengo.Ensemble].set_param("on_chip", nengo.params.BoolParam("on_chip", True))
        host, a = nengo.Ensemble(1, 1, label="host"), nengo.Ensemble(5, np.size(value), label="a")
        network.config[host].on_chip = False
        nengo.Connection(nengo.Node(value, label="n"), a)
        nengo.Connection(host.neurons, a.neurons, transform=np.full((5, 1), 1e-3))
    return compile_network(network).image


def test_the_source_of_an_input_that_lost_most_counts_and_spikes_of_neurons_do_not() -> None:
    image = image_of([1.0, 1.0])
    sources = np.zeros(image.n_inputs)
    lost = LostSpikes(image, sources)
    assert lost.by_input() == {"n -> a": 0}
    for n_spikes in (1, 2, 3):
        sources[:] = ONE  # the others spike once, which every source may
        sources[0], sources[-1] = n_spikes * ONE, 2 * ONE
        lost.count()
    assert lost.by_input() == {"n -> a": 2}


def test_an_input_without_a_connection_of_its_own_is_named_by_the_blocks_that_it_reaches() -> None:
    image = image_of(1.0)
    first, *others = image.manifest.inputs
    inputs = (replace(first, name="n"), *others)
    renamed = replace(image, manifest=replace(image.manifest, inputs=inputs))
    lost = LostSpikes(renamed, np.zeros(image.n_inputs))
    assert lost.by_input() == {"n to a": 0}
