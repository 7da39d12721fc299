"""Forged images: one or several arrays of a good image are changed at will."""

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.tables import LAYOUT
from spikeport.compile.image.validation import LEARNING
from spikeport.errors import ImageError
from tests.helpers.images import Block, Group, Output, Parts, Route

EXTREMES = (-(2**31), -32768, -2, -1, 0, 1, 2, 3, 7, 100, 4095, 32767, 10**6, 2**31 - 1)


def good() -> ChipImage:
    """Return an image that has every table: 2 cores, atoms, a shared row, an input, 2 outputs."""
    blocks = [Block(4, bias=[0, 900, 5_000, 20_000], vth=2**14), Block(6, core=1, vth=2**13)]
    wide = Group([[[64] * 3, [-64] * 3], [[128] * 3, [192] * 3]], axon_row=[0, 1, 1], block=1)
    wide.axon_base = np.array([0, 1, 3])
    back = Group([[64, 64, 64, 64], [960] * 2], axon_base=[0, 2])
    routes = [
        Route([0, 1, 2, -1], [0, 1, 0, 0], group=0, block=0),
        Route([0] * 6, group=1, block=1),
        Route([1, -1, 0], group=1, input=0),
    ]
    outputs = [Output("voltage", [4, 5], decoded=True), Output("spiked", [0, 1, 2])]
    return Parts(blocks, [wide, back], [3], routes, outputs).image()


def learning(n: int = 4) -> ChipImage:
    """Return an image with a group that learns: two sources, each with a row for n compartments."""
    numbers = {"on": 1, "lr_int": 1, "lr_exp": 0, "tracing_tau": 5, "tracing_mag": 1.5}
    numbers |= {"train_epoch": 2, "learn_epoch": 4}
    group = Group([[[64] * n], [[-64] * n]], learning=[numbers[name] for name in LEARNING])
    return Parts(
        [Block(n)], [group], [2], [Route([0, 1], input=0)], [Output("spiked", [0])]
    ).image()


def forged(image: ChipImage, rng: np.random.RandomState) -> ChipImage:
    """Return the image with some arrays changed, and with a digest that fits them.

    Raises
    ------
    ImageError
        If no table can hold the changed arrays.
    """
    arrays = dict(image.arrays)
    for name in rng.choice(list(LAYOUT), size=rng.choice([1, 1, 2, 4]), replace=False):
        arrays[name] = _changed(arrays[name], rng)
    return ChipImage.from_arrays(image.manifest, arrays)


def _changed(array: np.ndarray, rng: np.random.RandomState) -> np.ndarray:
    array = np.array(array, dtype=np.float64 if array.dtype.kind == "f" else np.int64)
    way = rng.randint(8)
    if way == 0:
        return array[: rng.randint(len(array) + 1)]  # too short
    if way == 1:
        return np.concatenate([array, array[-1:], array[-1:]])  # too long
    if way == 2:
        return array.reshape(-1)[:1].reshape(()) if array.size else array  # a scalar
    if way == 3:
        return rng.permutation(array)
    if array.size:
        n = rng.choice([1, 1, 1, array.size])
        array.flat[rng.randint(array.size, size=n)] = rng.choice(EXTREMES, size=n)
    return array


def run(image: ChipImage, n_steps: int = 8) -> None:
    """Check an image as when it is loaded, and step it."""
    from spikeport.backends.native.chip import NativeChip

    chip = NativeChip(image, seed=0)
    everything = np.arange(image.n_inputs)
    sizes = np.diff(image.blocks.start)[image.groups.block] // 2
    errors = {group: np.ones(sizes[group], dtype=int) for group in np.flatnonzero(image.learns)}
    for _ in range(n_steps):
        chip.step(everything, errors)
    chip.activity()


def attack(seeds: range) -> tuple[int, int]:
    """Forge and run many images; return how many were refused, and how many ran."""
    images, refused = (good(), learning()), 0
    for seed in seeds:
        try:
            run(forged(images[seed % 2], np.random.RandomState(seed)))
        except ImageError:
            refused += 1
    return refused, len(seeds) - refused
