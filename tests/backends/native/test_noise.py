"""Noise of compartments, drawn as nengo-loihi draws it."""

import numpy as np

from spikeport.backends.native.noise import Noise
from tests.helpers.images import Block, Parts


def drawn(n: int) -> np.ndarray:
    return np.random.RandomState(3).randint(-127, 128, size=n, dtype=np.int32)


def test_exponent_and_offset_scale_and_shift_the_noise() -> None:
    blocks = [
        Block(2, enable_noise=1, noise_exp=9, noise_offset=2),
        Block(1, enable_noise=1, noise_exp=7, noise_at_membrane=1),
        Block(1, noise_exp=9),
    ]
    noise = Noise(Parts(blocks).image(), np.random.RandomState(3), drawn_anyway=False)
    uniform = drawn(4)
    on_q, on_u = noise.draw()
    assert on_q.tolist() == [4 * (uniform[0] + 128), 4 * (uniform[1] + 128), 0, 0]
    assert on_u.tolist() == [0, 0, uniform[2], 0]


def test_without_noisy_compartments_the_random_stream_does_not_advance() -> None:
    rng = np.random.RandomState(3)
    assert Noise(Parts([Block(4)]).image(), rng, drawn_anyway=False).draw().shape == (2, 0)
    assert rng.randint(-127, 128, size=4, dtype=np.int32).tolist() == drawn(4).tolist()


def test_the_random_stream_advances_without_noise_if_others_need_it() -> None:
    rng = np.random.RandomState(3)
    noise = Noise(Parts([Block(4)]).image(), rng, drawn_anyway=True)
    assert noise.draw().shape == (2, 0)  # drawn, and nowhere to be added
    assert rng.randint(-127, 128, size=2, dtype=np.int32).tolist() == drawn(6)[4:].tolist()
