"""Image passes, which leave images that compute the same integers."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.parse import parse
from tests.helpers.images import images
from tests.helpers.same_run import assert_same_run, context, small_chip

pytestmark = pytest.mark.filterwarnings("ignore:Overflow in")

LIMITS = ("compartments", "in_axons", "out_axons", "synapse_bits", "threshold_profiles")


@pytest.mark.slow
@settings(max_examples=50)
@given(
    image=images(),
    seed=st.integers(0, 2**32 - 1),
    limits=st.tuples(
        st.integers(1, 12),
        st.integers(1, 12),
        st.integers(1, 12),
        st.integers(1, 12).map(lambda words: 64 * words),
        st.integers(1, 8),
    ),
)
@pytest.mark.parametrize(
    "text", ["merge_axons", "split", "pack{effort=3}", "merge_axons,split,pack,place"]
)
def test_any_image_computes_the_same_after_image_passes(
    text: str, image: ChipImage, seed: int, limits: list[int]
) -> None:
    after = image
    for one in parse(text).passes:
        after = one.apply(after, context(small_chip(**dict(zip(LIMITS, limits, strict=True)))))
    assert_same_run(image, after, seed=seed)
