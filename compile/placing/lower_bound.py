"""Lower bounds of the number of cores: no packing of an image's blocks goes below them."""

import math
from collections.abc import Iterable, Sequence

from spikeport.compile.image.usage import AMOUNTS
from spikeport.compile.placing.load import PROFILES, Capacity, Load, together
from spikeport.compile.placing.tally import Tally


def lower_bound(loads: Sequence[Load], room: Capacity) -> dict[str, int]:
    """Return how many cores blocks take at least, by reason.

    The reasons are those of `sums`, and ``"apart"``: the size of a set of blocks of which no two
    fit on one core.

    Parameters
    ----------
    loads : sequence of Load
        The load of each block.
    room : Capacity
        The capacity of a core.

    Returns
    -------
    bounds : dict of str to int
        Bounds by reason; the largest of them again as ``"cores"``.
    """
    bounds = {**sums(loads, room), "apart": _incompatible(loads, room)}
    return {**bounds, "cores": max(bounds.values())}


def sums(loads: Sequence[Load], room: Capacity) -> dict[str, int]:
    """Return how many cores blocks take at least even if they are cut, by resource.

    amounts     ceil(sum over all blocks / amount of a core)
    profiles    ceil(number of distinct profiles / registers of a core)

    Parameters
    ----------
    loads : sequence of Load
        The load of each block.
    room : Capacity
        The capacity of a core.
    """
    total = together(loads)
    # Settings that blocks of a core must share are left out: `_incompatible` takes account of them.
    counts = [mask.bit_count() for mask in total.profiles[: len(PROFILES)]]
    used = (*total.amounts, *counts)
    most = (*room.amounts, *room.profiles[: len(PROFILES)])
    names = AMOUNTS + PROFILES
    return {name: math.ceil(a / b) for name, a, b in zip(names, used, most, strict=True)}


def _incompatible(loads: Sequence[Load], room: Capacity) -> int:
    """Return the size of the largest such set found, with blocks sorted by each amount in turn."""

    def by_amount(kind: int) -> list[Load]:
        return sorted(loads, key=lambda load: load.amounts[kind], reverse=True)

    union, kinds = together(loads), range(len(room.amounts))
    return max(_count_incompatible(by_amount(kind), Tally(room, union)) for kind in kinds)


def _count_incompatible(loads: Iterable[Load], chosen: Tally) -> int:
    """Count blocks, in this order, that do not fit on a core with any block counted before."""
    n = 0
    for load in loads:
        if not len(chosen.with_room(load)):
            chosen.put(n, load)
            n += 1
    return n
