"""Small packing problems, made by hand or at random, and their solution by brute force."""

from collections.abc import Iterator, Mapping

import numpy as np
from hypothesis import strategies as st
from scipy import sparse

from spikeport.compile.image.traffic import BlockTraffic
from spikeport.compile.placing.load import Capacity, Load
from spikeport.compile.placing.problem import Bins, Problem

ROOM = Capacity((10, 10, 10, 10), (2, 2, 2, 1, 1, 1))
HARD = (13, 14, 18, 12, 18, 21)
"""Sizes that almost fill two cores of 50, and that the simple rules spread over three."""


def load(compartments: int = 0, thresholds: int = 0, clipping: int = 0, in_axons: int = 0) -> Load:
    """Return a load; profiles are bit masks."""
    return Load((compartments, in_axons, 0, 0), (0, thresholds, 0, clipping, 0, 0))


def cores_of(compartments: float) -> Capacity:
    return Capacity((compartments, np.inf, np.inf, np.inf), ROOM.profiles)


def problem(
    *loads: Load | int,
    room: Capacity = ROOM,
    traffic: object = None,
    audiences: Mapping[tuple[int, ...], int] | None = None,
) -> Problem:
    """Return a problem of loads (or compartments), spikes of pairs of blocks, and audiences."""
    all_loads = [one if isinstance(one, Load) else load(one) for one in loads]
    matrix = np.zeros((len(loads), len(loads)))
    for (a, b), spikes in dict(traffic or {}).items():
        matrix[a, b] = matrix[b, a] = spikes
    return Problem(all_loads, room, BlockTraffic(sparse.csr_matrix(matrix), audiences or {}))


def pairs(of: Problem) -> np.ndarray:
    """Return the spikes between each pair of blocks, (n_blocks, n_blocks)."""
    between = of.traffic.direct.toarray()
    for blocks, sources in of.traffic.audiences.items():
        between[np.ix_(blocks, blocks)] += sources
    np.fill_diagonal(between, 0)
    return between


@st.composite
def problems(draw: st.DrawFn, most_blocks: int = 10) -> Problem:
    """Draw random blocks, each of which fits on a core."""
    masks = st.sampled_from([0, 1, 2, 4, 3, 5])
    shared = st.sampled_from([0, 1, 2])
    profiles = st.tuples(masks, masks, masks, shared, shared, shared)
    amounts = st.tuples(*[st.integers(0, 10)] * 4)
    loads = draw(st.lists(st.builds(Load, amounts, profiles), max_size=most_blocks))
    both = [(a, b) for b in range(len(loads)) for a in range(b)]
    spikes = draw(st.lists(st.integers(0, 9), min_size=len(both), max_size=len(both)))
    groups = st.lists(st.integers(0, len(loads) - 1), min_size=2, max_size=6, unique=True)
    heard = st.dictionaries(groups.map(sorted).map(tuple), st.integers(1, 5), max_size=3)
    audiences = draw(heard) if len(loads) > 1 else {}
    return problem(*loads, traffic=zip(both, spikes, strict=True), audiences=audiences)


def assert_packed(of: Problem, bins: Bins) -> None:
    """Assert that every block is on one core, and no core above its room."""
    assert sorted(block for blocks in bins for block in blocks) == list(range(len(of.loads)))
    assert all(of.fits(blocks) for blocks in bins)


def fewest_cores(of: Problem) -> int:
    """Return the number of cores of the best of all packings."""
    legal = (bins for bins in partitions(len(of.loads)) if all(map(of.fits, bins)))
    return min(map(len, legal))


def partitions(n: int) -> Iterator[Bins]:
    """Yield all ways to divide n blocks."""
    if n == 0:
        yield []
        return
    for bins in partitions(n - 1):
        for k in range(len(bins)):
            yield [[*blocks, n - 1] if i == k else blocks for i, blocks in enumerate(bins)]
        yield [*bins, [n - 1]]
