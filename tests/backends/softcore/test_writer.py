"""The writer of memory images: the words of an image, and refusals of what a core cannot hold."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.backends.softcore.memory import AXONS
from spikeport.backends.softcore.writer import written
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BackendError
from tests.helpers.fake_board import small_image
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.soft_images import soft_images, wide_image
from tests.helpers.softcore_integers import of_image, of_memory


def test_the_same_image_gives_the_same_digest() -> None:
    assert written(wide_image(3)).digest == written(wide_image(3)).digest
    assert written(wide_image(3)).digest != written(wide_image(4)).digest
    assert written(small_image()).digest[:16] == "421e01c8aa5b6be4"


def test_sums_are_in_the_units_of_the_weights() -> None:
    assert written(small_image()).unit == 6
    assert written(small_image(), unit=0).unit == 0
    with pytest.raises(BackendError, match=r"units of 2\^7 would cut weights, which are multiples"):
        written(small_image(), unit=7)


def assert_same_integers(image: ChipImage) -> None:
    expected, found = of_image(image), of_memory(written(image))
    np.testing.assert_array_equal(found.constants, expected.constants)
    assert found.weights.shape == expected.weights.shape
    assert (found.weights != expected.weights).nnz == 0


@pytest.mark.slow
@settings(max_examples=150)
@given(image=soft_images())
def test_the_memory_of_any_image_holds_its_integers(image: ChipImage) -> None:
    assert_same_integers(image)


def test_the_memory_of_wide_rows_holds_their_integers() -> None:
    image = wide_image(1)
    assert of_image(image).weights.nnz > 40_000
    assert_same_integers(image)


def test_a_silent_compartment_behind_a_full_table_of_axons_sends_nothing() -> None:
    image = Parts(
        blocks=[Block(n=513)],
        groups=[Group([[64]])],
        routes=[Route([0] * 512 + [-1], block=0) for _ in range(8)],
    ).image()
    assert len(written(image).cores[0].axons) == AXONS
    assert_same_integers(image)


def test_bounds_that_cross_hold_the_voltage_at_the_upper_one_as_numpys_clip_does() -> None:
    image = Parts(blocks=[Block(vmin=700, vmax=-5)]).image()
    assert np.clip(0, 700, -5) == -5
    assert of_memory(written(image)).constants[5:].ravel().tolist() == [-5, -5]


def test_a_changed_word_of_memory_changes_the_weights_read_from_it() -> None:
    image = wide_image(1)
    memory = written(image)
    row = int(memory.cores[0].axons[0]) & 0xFFFF
    memory.cores[0].rows[row + 2] ^= 1
    assert (of_memory(memory).weights != of_image(image).weights).nnz > 0


def sparse_rows(n: int) -> Group:
    """Return n different rows of 340 weights; a row takes two words more than it has weights."""
    rng = np.random.RandomState(0)
    weights = rng.randint(1, 100, (n, 1, 340))
    return Group(list(weights), [np.arange(0, 1020, 3)[np.newaxis]] * n)


def parts(block: Block, groups: Sequence[Group] = (), routes: Sequence[Route] = ()) -> Parts:
    return Parts(blocks=[block], groups=list(groups), inputs=[200], routes=list(routes))


@pytest.mark.parametrize(
    ("refused", "reason"),
    [
        (
            parts(Block(enable_noise=1)),
            "1 compartments have noise, and a soft core has no random numbers",
        ),
        (
            parts(Block(n=2), [Group([[64, 64]], learning=(1, 1, 1, 1, 1, 1, 1))]),
            "SP109 learning synapses: 1 groups, limit none",
        ),
        (parts(Block(bias=2**23)), "bias 8,388,608: registers hold -8,388,608 to 8,388,607"),
        (parts(Block(refract_delay=64)), "refractory delay 64: registers hold 0 to 63"),
        (parts(Block(vmin=-(2**30))), "vmin -1,073,741,824: registers hold"),
        (parts(Block(n=1025)), "SP103 compartments: 1,025, limit 1,024"),
        (parts(Block(n=40, decay_u=range(40))), "SP105 compartment-profiles: 40, limit 32"),
        (parts(Block(n=40, vth=range(40))), "SP106 threshold-profiles: 40, limit 32"),
        (
            parts(Block(n=1020), [sparse_rows(200)], [Route(range(200), input=0)]),
            "SP104 synapse-bits: 1,094,400, limit 1,048,576",
        ),
        (
            Parts(
                blocks=[Block(n=1000)],
                groups=[Group([[64]])],
                routes=[Route([0] * 1000, block=0) for _ in range(5)],
            ),
            "SP101 out-axons: 5,000, limit 4,096",
        ),
    ],
)
def test_images_that_a_core_cannot_hold_are_refused_by_rule(refused: Parts, reason: str) -> None:
    with pytest.raises(BackendError, match="the soft core cannot hold the image") as caught:
        written(refused.image())
    assert reason in str(caught.value)


def test_blocks_of_a_core_with_different_bounds_are_refused() -> None:
    image = Parts(blocks=[Block(vmin=-5), Block(vmin=-6)]).image()
    with pytest.raises(BackendError, match="SP108 shared settings: 2 of clipping, limit 1"):
        written(image)
