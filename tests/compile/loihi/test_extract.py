"""Tables of an image, compared with the blocks that they were made from."""

import nengo
import numpy as np

from spikeport.compile.image.tables import part
from spikeport.compile.loihi.extract import extract
from tests.helpers.chip_networks import integer_blocks, recurrent

BLOCKS = integer_blocks(recurrent())
IMAGE = extract(BLOCKS, "loihi")


def test_every_block_has_a_core_and_its_integers() -> None:
    assert IMAGE.manifest.chip == "loihi"
    assert IMAGE.blocks.core.tolist() == list(range(len(BLOCKS.blocks)))
    for number, block in enumerate(BLOCKS.blocks):
        mine = part(IMAGE.blocks.start, number)
        for name in ("bias", "vth", "decay_u", "decay_v", "refract_delay"):
            expected = getattr(block.compartment, name)
            assert np.array_equal(getattr(IMAGE.compartments, name)[mine], expected), name
        assert IMAGE.blocks.vmax[number] == block.compartment.vmax


def test_weights_lie_row_by_row_in_the_order_of_blocks() -> None:
    rows = [
        (weights, indices)
        for block in BLOCKS.blocks
        for synapse in block.synapses
        for weights, indices in zip(synapse.weights, synapse.indices, strict=True)
    ]
    assert np.array_equal(IMAGE.synapses.weight, np.concatenate([w.ravel() for w, _ in rows]))
    assert np.array_equal(IMAGE.synapses.index, np.concatenate([i.ravel() for _, i in rows]))
    assert IMAGE.rows.atoms.tolist() == [len(w) for w, _ in rows]


def test_neurons_reach_the_axons_they_are_wired_to() -> None:
    with nengo.Network(seed=1) as network:
        one = {"gain": np.ones(3), "bias": np.full(3, 2.0)}
        a = nengo.Ensemble(3, 1, label="a", **one)
        b = nengo.Ensemble(3, 1, label="b", **one)
        transform = [[1.0, 0.25], [0.5, 0.5], [0.25, 1.0]]
        nengo.Connection(a.neurons[[2, 0]], b.neurons, transform=transform, synapse=0.005)
        nengo.Probe(b.neurons[1:])
    image = extract(integer_blocks(network), "loihi")
    assert (image.routes.source.tolist(), image.routes.from_input.tolist()) == ([0], [0])
    axon_of = image.out_axons.axon.tolist()
    assert axon_of[1] == -1
    rows = {
        source: image.synapses.weight[part(image.rows.start, image.in_axons.row[axon_of[source]])]
        for source in (0, 2)
    }
    # column 0 of the transform is neuron 2's, column 1 neuron 0's
    for source, column in ((2, [1.0, 0.5, 0.25]), (0, [0.25, 0.5, 1.0])):
        np.testing.assert_allclose(rows[source] / rows[source].max(), column, atol=0.01)
    assert image.reads.compartment.tolist() == [4, 5]
    assert image.manifest.outputs[0].key == "spiked"
