"""How few cores an image could take: bounds that no packing of its blocks goes below."""

import math
from collections.abc import Sequence

from spikeport.compile.placing.load import PROFILES, Capacity, Load, together
from spikeport.compile.usage import AMOUNTS


def lower_bound(loads: Sequence[Load], room: Capacity) -> dict[str, int]:
    """Cores that blocks take at least, by reason; ``"cores"`` is the largest of them.

    Those of `sums`, and as ``"apart"`` the size of a set of blocks of which no two fit on one core.

    Parameters
    ----------
    loads : sequence of Load
        What each block takes.
    room : Capacity
        What a core has.
    """
    bounds = {**sums(loads, room), "apart": _apart(loads, room)}
    return {**bounds, "cores": max(bounds.values())}


def sums(loads: Sequence[Load], room: Capacity) -> dict[str, int]:
    """Cores that blocks take at least even if they are cut, by resource.

    amounts     ceil(sum over all blocks / what a core has)
    profiles    ceil(number of distinct ones / registers of a core)
    """
    total = together(loads)
    counts = [mask.bit_count() for mask in total.profiles[: len(PROFILES)]]
    used, most = (*total.amounts, *counts), (*room.amounts, *room.profiles)
    names = AMOUNTS + PROFILES
    return {name: math.ceil(a / b) for name, a, b in zip(names, used, most, strict=False)}


def _apart(loads: Sequence[Load], room: Capacity) -> int:
    """Size of the largest set found, taking blocks by one amount after another."""
    orders = [lambda load, k=k: load.amounts[k] for k in range(len(room.amounts))]
    return max(_taken_apart(sorted(loads, key=by, reverse=True), room) for by in orders)


def _taken_apart(loads: Sequence[Load], room: Capacity) -> int:
    """Blocks, in this order, none of which fits on a core with any taken before."""
    apart: list[Load] = []
    for load in loads:
        if not any(room.holds(load.joined(other)) for other in apart):
            apart.append(load)
    return len(apart)
