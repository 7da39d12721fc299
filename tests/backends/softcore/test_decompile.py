"""A memory image has the integers of the image it was written from."""

import numpy as np
from hypothesis import given, settings

from spikeport.backends.softcore import decompile
from spikeport.backends.softcore.memory import AXONS
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.soft_images import soft_images, wide_image


def assert_same_integers(image: ChipImage) -> None:
    expected, found = decompile.of_image(image), decompile.of_memory(written(image))
    np.testing.assert_array_equal(found.constants, expected.constants)
    assert found.weights.shape == expected.weights.shape
    assert (found.weights != expected.weights).nnz == 0


@settings(max_examples=150)
@given(image=soft_images())
def test_any_image_comes_back(image: ChipImage) -> None:
    assert_same_integers(image)


def test_wide_rows_come_back() -> None:
    image = wide_image(1)
    assert decompile.of_image(image).weights.nnz > 40_000
    assert_same_integers(image)


def test_a_silent_compartment_behind_a_full_table_of_axons_sends_nothing() -> None:
    image = Parts(
        blocks=[Block(n=513)],
        groups=[Group([[64]])],
        routes=[Route([0] * 512 + [-1], block=0) for _ in range(8)],
    ).image()
    assert len(written(image).cores[0].axons) == AXONS
    assert_same_integers(image)


def test_a_changed_weight_is_seen() -> None:
    image = wide_image(1)
    memory = written(image)
    row = int(memory.cores[0].axons[0]) & 0xFFFF
    memory.cores[0].rows[row + 2] ^= 1
    assert (decompile.of_memory(memory).weights != decompile.of_image(image).weights).nnz > 0
