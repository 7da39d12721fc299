"""Numbers of an image in floating point: the exact and the rounded ones."""

import numpy as np

from spikeport.compile.loihi.extract import extract
from spikeport.compile.loihi.numbers import restored, wanted
from tests.helpers.chip_networks import integer_blocks, recurrent

BLOCKS = integer_blocks(recurrent())


def test_numbers_have_the_shapes_of_the_image() -> None:
    image = extract(BLOCKS, "loihi")
    for numbers in (wanted(BLOCKS), restored(BLOCKS)):
        assert len(numbers.weights) == len(image.synapses)
        for name in ("bias", "vth", "decay_u", "decay_v", "vmin", "vmax", "to_integers"):
            assert getattr(numbers, name).shape == (image.n_compartments,)


def test_rounded_numbers_are_near_the_exact_ones() -> None:
    exact, rounded = wanted(BLOCKS), restored(BLOCKS)
    for name in ("weights", "bias", "vth", "decay_u", "decay_v"):
        a, b = getattr(exact, name), getattr(rounded, name)
        largest = np.abs(a).max()
        assert 0 < np.abs(a - b).max() < 0.02 * largest, name
        np.testing.assert_allclose(b, a, atol=0.02 * largest, err_msg=name)


def test_restored_numbers_times_their_scale_are_the_integers_of_the_image() -> None:
    image, rounded = extract(BLOCKS, "loihi"), restored(BLOCKS)
    np.testing.assert_allclose(rounded.vth * rounded.to_integers, image.compartments.vth)
    np.testing.assert_allclose(rounded.decay_v * 4096, image.compartments.decay_v)


def test_with_part_replaces_a_part_of_one_array_in_a_copy() -> None:
    exact, rounded = wanted(BLOCKS), restored(BLOCKS)
    mixed = exact.with_part("bias", rounded, slice(2, 4))
    assert np.array_equal(mixed.bias[2:4], rounded.bias[2:4])
    assert np.array_equal(mixed.bias[:2], exact.bias[:2])
    assert np.array_equal(mixed.bias[4:], exact.bias[4:])
    assert mixed.weights is exact.weights
    assert not np.array_equal(exact.bias[2:4], rounded.bias[2:4])
