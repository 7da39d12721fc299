"""The manifest of an image: its inputs and outputs, and the entries of its blocks."""

from collections.abc import Callable

import nengo
import nengo_loihi
import numpy as np
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import BlockEntry, Encoding, Filter, read_header
from spikeport.compile.pipeline import compile_network
from spikeport.errors import ImageError


def crossing() -> nengo.Network:
    """Return a network with values and spikes from the host, and both back to it."""
    with nengo.Network(seed=4) as network:
        nengo_loihi.add_params(network)
        stimulus = nengo.Node([0.3, -0.2], label="stimulus")
        spiking = nengo.Ensemble(6, 1, label="spiking")
        network.config[spiking].on_chip = False
        on_chip = nengo.Ensemble(20, 2, label="on chip")
        nengo.Connection(stimulus, on_chip, synapse=0.007)
        weights = np.full((20, 6), 1e-3)
        nengo.Connection(spiking.neurons, on_chip.neurons, transform=weights, synapse=0.02)
        sink = nengo.Node(lambda _t, x: None, size_in=2, label="sink")
        nengo.Connection(on_chip, sink, synapse=nengo.Alpha(0.03))
        nengo.Probe(on_chip.neurons, label="spikes")
    return network


def image() -> ChipImage:
    return compile_network(crossing(), pipeline="").image


def test_an_input_says_how_the_host_encodes_it() -> None:
    values, spikes = image().manifest.inputs
    assert (values.name, values.size) == ("stimulus -> on chip", 4)
    assert values.encoding == Encoding("on_off", gain=500.0, bias=500.0)
    assert values.filter == Filter("Lowpass", 0.007)
    assert (spikes.name, spikes.size) == ("spiking -> on chip", 6)
    assert spikes.encoding == Encoding("spikes")
    assert spikes.filter is None


def test_the_equation_of_an_encoding_gives_the_spikes_of_the_host() -> None:
    """J = gain x + bias for the first d sources, -gain x + bias for the others."""
    with nengo.Network(seed=4) as network:
        x = np.array([0.3, -0.2])
        on_chip = nengo.Ensemble(20, 2)
        nengo.Connection(nengo.Node(x), on_chip, synapse=None)
        nengo.Probe(on_chip)
    encoding = compile_network(network).image.manifest.inputs[0].encoding
    rates = np.concatenate([encoding.gain * x, -encoding.gain * x]) + encoding.bias
    from spikeport.backends.host_loop import HostLoop
    from spikeport.backends.native.chip import NativeChip
    from spikeport.backends.recorder import Recorder

    compilation = compile_network(network)
    recorder = Recorder(NativeChip(compilation.image, seed=0))
    loop = HostLoop(compilation, recorder, seed=0)
    for _ in range(1000):
        loop.step()
    counted = np.bincount(np.concatenate(recorder.spikes), minlength=4)
    np.testing.assert_allclose(counted, rates, atol=1)


def test_an_output_has_the_name_and_filter_of_its_connection_or_probe() -> None:
    outputs = {entry.name: entry for entry in image().manifest.outputs}
    assert set(outputs) == {"on chip -> sink", "spikes"}
    assert outputs["on chip -> sink"].filter == Filter("Alpha", 0.03)
    assert (outputs["on chip -> sink"].key, outputs["on chip -> sink"].size) == ("voltage", 2)
    assert (outputs["spikes"].key, outputs["spikes"].size) == ("spiked", 20)


def test_a_label_is_made_of_owner_and_pieces() -> None:
    whole = BlockEntry("ensemble", "pool")
    piece = BlockEntry("ensemble", "pool", piece=((0, 2),), cut=((2, 3),))
    assert (whole.label, whole.built) == ("pool", "pool")
    assert (piece.label, piece.built) == ("pool[1/2][3/3]", "pool[1/2]")


def test_the_manifest_lists_the_bits_of_weight_and_index_codes(
    convolution: Callable[..., nengo.Network],
) -> None:
    manifest = compile_network(convolution()).image.manifest
    assert manifest.weight_bits == (0, 1, 2, 3, 4, 5, 6, 8)
    assert manifest.index_bits == (0, 6, 7, 8, 9, 10, 11, 12)


@pytest.mark.parametrize(
    ("manifest", "message"),
    [
        (rb'{"schema": "\u001b[2J"}', r"image schema \x1b[2J, this spikeport reads 2"),
        (rb'{"schema": 2, "arithmetic": "\n"}', r"chip 'None' that computes as '\n'"),
        (rb'{"schema": "%b"}' % (b"x" * 10**6), f"image schema {'x' * 400}..., this"),
    ],
)
def test_a_refusal_escapes_and_shortens_text_from_a_file(manifest: bytes, message: str) -> None:
    with pytest.raises(ImageError) as raised:
        read_header(b'{"manifest": %b}' % manifest)
    assert message in str(raised.value)
