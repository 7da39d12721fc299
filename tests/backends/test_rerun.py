"""Runs of an image on recorded spikes."""

import numpy as np
import pytest

from spikeport.backends.rerun import TAU_S, Rerun
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.images import Block, Group, Output, Parts

SILENT = [np.zeros(0, dtype=int)] * 3


def integrator(**settings: object) -> ChipImage:
    """Return a compartment that adds 5 to its voltage in every step, and is read out."""
    return Parts([Block(1, bias=5, **settings)], outputs=[Output("voltage", [0])]).image()


def test_outputs_of_the_image_are_filtered() -> None:
    keep, filtered = np.exp(-0.001 / TAU_S), [0.0]
    for voltage in (5, 10, 15):
        filtered.append(keep * filtered[-1] + (1 - keep) * voltage)
    found = Rerun(integrator(), SILENT).integers()
    np.testing.assert_allclose(found[:, 0], filtered[1:], rtol=1e-12)


def test_voltages_are_not_compared_if_spikes_are_read() -> None:
    reads = [Output("voltage", [0]), Output("spiked", [0])]
    found = Rerun(Parts([Block(1, bias=5)], outputs=reads).image(), SILENT).integers()
    assert found.shape == (3, 1)
    assert not found.any()  # 5, 10 and 15 are below the threshold


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (
            integrator(enable_noise=1),
            "cannot measure the loss of a network that learns or has noise on the chip: "
            "every run differs; compile it without --loss",
        ),
        (
            Parts(
                [Block(1)],
                [Group([[0]], learning=(1, 4, -7, 10, 8.5, 2, 4))],
                outputs=[Output("voltage", [0])],
            ).image(),
            "cannot measure the loss of a network that learns or has noise on the chip: "
            "every run differs; compile it without --loss",
        ),
        (
            Parts([Block(1)], outputs=[Output("current", [0])]).image(),
            "loss is measured on outputs of spikes, decoded values or voltages, and the network "
            "has none; add a probe",
        ),
    ],
)
def test_images_that_cannot_be_compared_are_refused(image: ChipImage, message: str) -> None:
    with pytest.raises(BackendError) as caught:
        Rerun(image, SILENT)
    assert str(caught.value) == message
