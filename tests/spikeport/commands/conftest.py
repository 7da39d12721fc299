"""A file for the report of a compile, and a small image in a file."""

import json
from pathlib import Path

import nengo
import pytest

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.pipeline import compile_network


@pytest.fixture
def report(tmp_path):
    """Return a file that a compile writes its report to, and a function that reads it."""
    path = tmp_path / "report.json"

    class Report:
        option = ("--json", path)

        def read(self):
            return json.loads(path.read_text())

    return Report()


@pytest.fixture(scope="module")
def image() -> ChipImage:
    with nengo.Network(seed=3) as network:
        stimulus = nengo.Node([0.5, -0.2], label="stimulus")
        a = nengo.Ensemble(40, 2, label="a [bold]b")
        nengo.Connection(stimulus, a)
        nengo.Probe(a, synapse=0.01, label="decoded")
        nengo.Probe(a.neurons, label="spikes")
    return compile_network(network).image


@pytest.fixture
def image_file(image: ChipImage, tmp_path: Path) -> Path:
    image.save(tmp_path / "image.npz")
    return tmp_path / "image.npz"
