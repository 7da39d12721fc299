"""A chip image as a value: tables, digest and the names of its cores."""

from dataclasses import fields, replace

import numpy as np
import pytest
from nengo_loihi.block import SynapseConfig

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import LAYOUT
from spikeport.compile.image.validation import LEARNING
from spikeport.errors import ImageError
from tests.helpers.images import Block, Group, Parts


def altered(array: np.ndarray) -> np.ndarray:
    if not array.size:
        return np.zeros((1, *array.shape[1:]), array.dtype)
    array = array.copy()
    array.flat[-1] += 1
    return array


@pytest.mark.parametrize("name", LAYOUT)
def test_the_digest_changes_with_every_array(name: str, image: ChipImage) -> None:
    other = ChipImage.from_arrays(
        image.manifest, {**image.arrays, name: altered(image.arrays[name])}
    )
    assert other.digest != image.digest
    assert other != image


def test_the_digest_changes_with_every_entry_of_the_manifest(image: ChipImage) -> None:
    for key in [one.name for one in fields(image.manifest)]:
        other = replace(image, manifest=replace(image.manifest, **{key: "another"}))
        assert other.digest != image.digest, key


def test_equal_images_are_one_element_of_a_set(image: ChipImage) -> None:
    twin = ChipImage.from_arrays(replace(image.manifest), image.arrays)
    other = replace(image, manifest=replace(image.manifest, dt_s=0.002))
    assert len({image, twin, other}) == 2
    assert image != "image"


def test_arrays_cannot_be_written(image: ChipImage) -> None:
    for array in image.arrays.values():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_an_image_keeps_its_own_copy_of_its_arrays(image: ChipImage) -> None:
    bias = image.compartments.bias.copy()
    copied = ChipImage.from_arrays(image.manifest, {**image.arrays, "bias": bias})
    bias[:] = 7
    assert np.array_equal(copied.compartments.bias, image.compartments.bias)


def test_missing_and_unknown_arrays_are_refused(image: ChipImage) -> None:
    arrays = {**image.arrays, "taste": np.zeros(1)}
    del arrays["bias"]
    with pytest.raises(ImageError) as raised:
        ChipImage.from_arrays(image.manifest, arrays)
    assert str(raised.value) == "image arrays do not follow schema 2: bias, taste"


def test_values_out_of_range_are_refused(image: ChipImage) -> None:
    with pytest.raises(ImageError) as raised:
        ChipImage.from_arrays(image.manifest, {**image.arrays, "indices": np.array([40_000])})
    assert str(raised.value) == "synapses.index: values of int64 do not fit into <i2"


def test_cores_are_called_after_the_blocks_on_them(image: ChipImage) -> None:
    together = ChipImage.from_arrays(
        image.manifest, {**image.arrays, "block_core": np.array([0, 1, 0, 1])}
    )
    assert image.cores == ("first", "second", "first -> second", "second -> decoded")
    assert together.cores == ("first + first -> second", "second + second -> decoded")
    assert list(together.compartment_core) == [0] * 12 + [1] * 10 + [0] * 40 + [1] * 4


def test_compartments_are_numbered_core_by_core() -> None:
    image = Parts([Block(2), Block(1, core=1), Block(3), Block(2, core=1)]).image()
    assert image.compartment_place.tolist() == [0, 1, 0, 2, 3, 4, 1, 2]


RULE = (1.0, 3.0, -2.0, 10.0, 0.5, 2.0, 4.0)


def test_synapses_of_a_group_follow_those_of_the_group_before() -> None:
    image = Parts([Block(2)], [Group([[1, 2], [3]]), Group([]), Group([[4]])]).image()
    assert image.synapse_start.tolist() == [0, 3, 3, 4]


def test_sources_of_spikes_and_sources_that_encode_values_differ(image: ChipImage) -> None:
    assert image.sends_spikes.tolist() == [False] * image.n_inputs
    assert Parts(inputs=[2, 0, 1]).image().sends_spikes.tolist() == [True] * 3


def test_two_compartments_share_an_error() -> None:
    groups = [Group([[1] * 4]), Group([[1] * 4], learning=RULE)]
    assert Parts([Block(5)], groups).image().error_sizes == {1: 2}


def test_settings_of_a_group_have_their_names() -> None:
    image = Parts(groups=[Group([[1]]), Group([[1]], learning=RULE)]).image()
    assert image.learning_of(0) == dict.fromkeys(LEARNING, 0.0)
    assert image.learning_of(1)["tracing_mag"] == 0.5
    assert tuple(image.learning_of(1).values()) == RULE
    assert SynapseConfig(**image.format_of(1)).n_synapses == image.format_of(1)["n_synapses"]
    assert list(image.format_of(1).values()) == image.groups.format[1].tolist()
