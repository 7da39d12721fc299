"""Images that a soft core can hold: random images with values clipped to its registers."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from spikeport.backends.softcore.verilated import Build
from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Output, Parts, Route, images

BUILD = Build(cores=6, unit=0, log_queue=2)
"""The only chip that tests build: it has room for all their images, and queues that soon fill."""
LARGEST = 2**23 - 1


def held(image: ChipImage) -> ChipImage:
    """Return an image without noise, and with values that fit into registers of 24 bits."""
    blocks, compartments = image.blocks, image.compartments
    # The blocks of a core get the bounds of its first block.
    first = np.array([np.flatnonzero(blocks.core == core)[0] for core in blocks.core])
    vmin, vmax = (_within(one) for one in (blocks.vmin[first], blocks.vmax[first]))
    few = compartments.refract_delay // 21 * 21, compartments.decay_u // 1365 * 1365
    return replace(
        image,
        blocks=replace(blocks, vmin=vmin, vmax=vmax),
        compartments=replace(
            compartments,
            bias=_within(compartments.bias),
            vth=_within(compartments.vth),
            refract_delay=few[0],
            decay_u=few[1],
            decay_v=np.where(compartments.decay_v > 2047, 4096, compartments.decay_v // 1000),
            enable_noise=np.zeros_like(compartments.enable_noise),
        ),
    )


def _within(values: np.ndarray) -> np.ndarray:
    return np.clip(values, -LARGEST - 1, LARGEST)


def soft_images() -> st.SearchStrategy[ChipImage]:
    """Draw small images: several atoms, weights of up to 32 bits, all decays, bad bounds."""
    return images().map(held)


def wide_image(seed: int) -> ChipImage:
    """Return 3 blocks on 2 cores: rows over 300 to 1,000 compartments, dense and with gaps, and
    sources that all reach one core at once.
    """
    rng = np.random.RandomState(seed)
    sizes, cores = (1000, 300, 700), (0, 1, 1)
    blocks = [
        Block(
            n=n,
            core=core,
            vmin=-40_000,
            bias=rng.randint(-200, 2000, n),
            decay_u=rng.choice([0, 100, 4095], n),
            decay_v=rng.choice([0, 300, 4096], n),
            vth=rng.choice([6400, 64000], n),
            refract_delay=rng.choice([1, 3], n),
        )
        for n, core in zip(sizes, cores, strict=True)
    ]
    groups, routes = [], []
    for block, n in enumerate(sizes):
        indices = [np.sort(rng.choice(n, rng.randint(1, n + 1), replace=False)) for _ in range(9)]
        weights = [rng.randint(-127, 128, len(i)) << rng.randint(6, 9) for i in indices]
        groups.append(Group(weights, [i[np.newaxis] for i in indices], block=block))
        for source, size in enumerate(sizes):
            axon = np.where(rng.rand(size) < 0.02, rng.randint(9, size=size), -1)
            routes.append(Route(axon, group=block, block=source))
        routes.append(Route(range(9), group=block, input=0))
    outputs = [Output(key, range(250, 260)) for key in ("voltage", "current", "spiked")]
    return Parts(blocks, groups, [9], routes, outputs).image()
