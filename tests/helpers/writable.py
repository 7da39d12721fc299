"""Random images whose integers all fit into registers, as nengo-loihi's discretiser makes them."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from spikeport.compile.image.chip_image import ChipImage
from tests.helpers.images import Block, Group, Output, Parts, Route

THRESHOLDS = (64, 6400, 64 * 131071)
INDEX_BITS_CODE = 6
"""The code of indices of 11 bits."""


@st.composite
def writable_images(draw: st.DrawFn) -> ChipImage:
    """Draw blocks on shared cores, groups of each kind of axon, unused axons, and noise."""
    rng = np.random.RandomState(draw(st.integers(0, 2**32 - 1), label="numbers"))
    sizes = draw(st.lists(st.integers(1, 9), min_size=1, max_size=4), label="block sizes")
    cores = np.unique(rng.randint(3, size=len(sizes)), return_inverse=True)[1]
    blocks = [_block(rng, n, int(core)) for n, core in zip(sizes, cores, strict=True)]
    groups = [_group(rng, b, n) for b, n in enumerate(sizes) for _ in range(rng.randint(3))]
    routes = [route for group in range(len(groups)) for route in _routes(rng, sizes, groups, group)]
    inputs = [6] if any(route.input == 0 for route in routes) else []
    outputs = [Output("spiked", np.arange(sizes[0])), Output("voltage", [0])]
    return writable(Parts(blocks, groups, inputs, routes, outputs).image())


def writable(image: ChipImage) -> ChipImage:
    """Return an image with formats that have room for all targets, and thresholds not too large."""
    vth = np.minimum(image.compartments.vth, THRESHOLDS[-1])
    form = image.groups.format.copy()
    form[:, image.manifest.synapse_format.index("idx_bits")] = INDEX_BITS_CODE
    groups, compartments = replace(image.groups, format=form), replace(image.compartments, vth=vth)
    return replace(image, groups=groups, compartments=compartments)


def _block(rng: np.random.RandomState, n: int, core: int) -> Block:
    return Block(
        n=n,
        core=core,
        vmin=-(2**23) + 1,
        noise_exp=7,
        bias=rng.randint(-4095, 4096, size=n) * 2 ** rng.randint(4),
        decay_u=rng.randint(4096, size=n),
        decay_v=rng.randint(4096, size=n),
        vth=rng.choice(THRESHOLDS, size=n),
        refract_delay=rng.randint(1, 4),
        enable_noise=rng.randint(2),
    )


def _group(rng: np.random.RandomState, block: int, n: int) -> Group:
    kind = rng.choice([0, 16, 32])
    atoms, span = (rng.randint(1, 4) if kind else 1), rng.randint(1, n + 1)
    n_rows = rng.randint(1, 4)
    n_axons = n_rows + rng.randint(3)  # nengo-loihi refuses rows that no axon reads
    base = 4 * rng.randint(-1, (n - span) // 4 + 1, size=n_axons)
    return Group(
        block=block,
        weights=[64 * rng.randint(-255, 256, size=(atoms, span)) for _ in range(n_rows)],
        axon_row=rng.permutation(n_axons) % n_rows,
        axon_base=np.append(np.maximum(base[:-1], -1), abs(base[-1:]) // 8 * 4),
        pop_type=kind,
    )


def _routes(
    rng: np.random.RandomState, sizes: list[int], groups: list[Group], number: int
) -> list[Route]:
    """Return a route from the host and one from a block, with random axons and atoms."""
    group, source = groups[number], int(rng.randint(len(sizes)))
    made = []
    for size, of in ((6, {"input": 0}), (sizes[source], {"block": source})):
        axon = rng.randint(-1, len(group.axon_row), size=size)
        atom = np.where(axon < 0, 0, rng.randint(len(group.weights[0]), size=size))
        made.append(Route(axon=axon, atom=atom, group=number, **of))
    return made
