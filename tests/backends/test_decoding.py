"""Outputs of an image, decoded from what its compartments hold."""

import tracemalloc
from dataclasses import replace

import nengo
import numpy as np
import pytest

from spikeport.backends.decoding import Decoder, Output, OutputRecording
from spikeport.compile.image import tables
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.manifest import OutputEntry
from tests.helpers.images import Block, Parts
from tests.helpers.images import Output as Read


def image_of(entry: OutputEntry, weights: list[float]) -> ChipImage:
    """Return an image of one output of three compartments."""
    image = Parts([Block(3)], outputs=[Read("voltage", [0, 1, 2])]).image()
    return replace(
        image,
        manifest=replace(image.manifest, outputs=(entry,)),
        outputs=replace(image.outputs, weight_start=np.array([0, len(weights)])),
        decoders=tables.Decoders(weight=np.array(weights, dtype=float)),
    )


def entry(weights: str, shape: tuple[int, ...], **more: object) -> OutputEntry:
    given = {"layout": "C", "segments": (3,)} | more
    return OutputEntry(name="out", key="voltage", weights=weights, shape=shape, **given)


MATRIX = entry("matrix", (3, 2)), [1.0, 0.5, 0.0, 2.0, -1.0, 0.0]
RAW = np.array([2, 3, 4])


@pytest.mark.parametrize(
    ("output", "values"),
    [
        ((entry("none", (0,)), []), [2, 3, 4]),
        ((entry("none", (0,), order=(2, 0, 1)), []), [4, 2, 3]),
        ((entry("scale", (1,)), [0.5]), [1, 1.5, 2]),
        (MATRIX, [2 - 4, 1 + 6]),
        ((replace(MATRIX[0], segments=(1, 2)), MATRIX[1]), [2 - 4, 1 + 6]),
    ],
)
def test_values_are_scaled_reordered_or_multiplied_by_a_matrix(
    output: tuple[OutputEntry, list[float]], values: list[float]
) -> None:
    assert Output(image_of(*output), 0).decode(RAW).tolist() == values


def test_terms_are_the_weights_that_are_not_zero() -> None:
    found = Output(image_of(*MATRIX), 0).terms()
    assert [(e.tolist(), w.tolist()) for e, w in found] == [([0, 2], [1, -1]), ([0, 1], [0.5, 2])]


@pytest.mark.parametrize("held", [[2, 0, 0], [2, 3, 4], [0, 0, 0]])
def test_several_outputs_are_decoded_into_one_array(held: list[int]) -> None:
    image = Parts(
        [Block(3)], outputs=[Read("voltage", [0, 1, 2], decoded=True), Read("spiked", [1])]
    ).image()
    decoder = Decoder(image, [0, 1])
    values = np.full(decoder.size, np.nan)
    decoder.decode([np.array(held, dtype=np.int32), np.array([1], dtype=np.int32)], values)
    assert (decoder.size, decoder.parts) == (2, [slice(0, 1), slice(1, 2)])
    assert values.tolist() == [sum(held), 1]


def test_a_recording_is_sampled_and_keeps_its_filter_when_it_is_cleared() -> None:
    with nengo.Network():
        probe = nengo.Probe(nengo.Node(size_in=1), synapse=nengo.Lowpass(0.001), sample_every=0.002)
    image = Parts([Block(1)], outputs=[Read("voltage", [0])]).image()
    recording = OutputRecording(image, 0, probe)
    for _ in range(4):
        recording.append([np.array([1], dtype=np.int32)])
    filtered = 1 - np.exp(-np.arange(8))  # steps as long as the time constant; one step of delay
    np.testing.assert_allclose(recording.data()[:, 0], filtered[[2, 4]], rtol=1e-6)
    recording.clear()
    assert recording.data().shape == (0, 1)
    recording.append([np.array([1], dtype=np.int32)])
    recording.append([np.array([1], dtype=np.int32)])
    np.testing.assert_allclose(recording.data()[:, 0], filtered[[6]], rtol=1e-6)


@pytest.mark.parametrize("synapse", [None, 0.01])
def test_a_recording_keeps_no_more_than_its_samples(synapse: float | None) -> None:
    with nengo.Network():
        probe = nengo.Probe(nengo.Node(size_in=1000), synapse=synapse, sample_every=0.1)
    image = Parts([Block(1000)], outputs=[Read("voltage", list(range(1000)))]).image()
    recording, held = OutputRecording(image, 0, probe), [np.zeros(1000, dtype=np.int32)]
    tracemalloc.start()
    for _ in range(1000):
        recording.append(held)
    kept_bytes = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert recording.data().shape == (10, 1000)
    assert kept_bytes < 20 * 1000 * 8
