"""Random images on the native backend, nengo-loihi's emulator and the oracle, bit for bit."""

from unittest import mock

import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from spikeport.backends.native import wiring
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import images
from tests.helpers.side_by_side import assert_equal_steps, random_spikes

pytestmark = pytest.mark.filterwarnings("ignore:Overflow in")


@pytest.mark.slow
@settings(max_examples=200)
@given(
    image=images(),
    seed=st.integers(0, 2**32 - 1),
    short=st.sampled_from([0, 4, wiring.SHORT]),
    growth=st.sampled_from([0, 100]),
)
def test_any_image_has_equal_state_outputs_and_counts(
    image: ChipImage, seed: int, short: int, growth: int
) -> None:
    with mock.patch.multiple(wiring, SHORT=short, MOST_GROWTH=growth):
        states = assert_equal_steps(image, seed, random_spikes(image, 20, seed))
    event(f"chip spikes: {any(s.spiked.any() for s in states)}")
