from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.compile.placing.core_traffic import CoreTraffic
from spikeport.compile.placing.gains import Gains
from spikeport.compile.placing.load import Load
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.compile.placing.settling import settled
from tests.helpers.packing_problems import assert_packed, cores_of, pairs, problem, problems


def within(of: Problem, bins: Bins) -> float:
    return -of.cost(bins)[1]


def test_blocks_move_to_the_core_they_exchange_most_spikes_with() -> None:
    of = problem(2, 2, 2, traffic={(0, 1): 1, (0, 2): 2})
    assert settled(of, [[0, 1], [2]]) == settled(of, [[0], [1], [2]]) == [[2, 0, 1]]
    crowded = problem(5, 5, 5, traffic={(0, 1): 1, (0, 2): 2})
    assert sorted(map(sorted, settled(crowded, [[0, 1], [2]]))) == [[0, 2], [1]]


def test_full_cores_swap_blocks() -> None:
    of = problem(5, 5, 5, 5, traffic={(0, 2): 1, (1, 3): 1})
    assert sorted(map(sorted, settled(of, [[0, 1], [2, 3]]))) == [[0, 2], [1, 3]]


def test_blocks_do_not_swap_if_that_breaks_a_limit() -> None:
    of = problem(4, 6, 6, 4, traffic={(0, 3): 9})
    assert settled(of, [[0, 1], [2, 3]]) == [[0, 1], [2, 3]]


def test_blocks_do_not_swap_if_that_loses_more_spikes_within_cores() -> None:
    of = problem(5, 5, 5, 5, traffic={(0, 2): 2, (0, 1): 1, (2, 3): 2})
    assert settled(of, [[0, 1], [2, 3]]) == [[0, 1], [2, 3]]


def test_a_block_moves_once_another_has_made_room() -> None:
    of = problem(3, 3, 5, 5, 5, 3, traffic={(0, 3): 1, (2, 4): 9})
    assert settled(of, [[0, 1, 5], [2, 3], [4]]) == [[1, 5], [3, 0], [4, 2]]


def test_settling_does_not_change_the_packing_it_starts_from() -> None:
    bins = [[0], [1]]
    assert settled(problem(1, 1, traffic={(0, 1): 1}), bins) == [[1, 0]]
    assert bins == [[0], [1]]


@pytest.mark.slow
@given(problems())
@settings(max_examples=100)
def test_settled_packings_keep_all_limits_and_at_least_as_many_spikes_within_cores(
    of: Problem,
) -> None:
    for bins in (pack(of, 0), [[block] for block in range(len(of.loads))]):
        after = settled(of, bins)
        assert_packed(of, after)
        assert len(after) <= len(bins)
        assert within(of, after) >= within(of, bins)
        assert settled(of, after) == after
        moved = sorted(map(sorted, after)) != sorted(map(sorted, filter(None, bins)))
        assert moved == (within(of, after) > within(of, bins))


@pytest.mark.slow
@given(problems())
@settings(max_examples=100)
def test_settling_gives_the_result_of_trying_every_move(of: Problem) -> None:
    bins, packed = [[block] for block in range(len(of.loads))], pack(of, 0)
    for start in (bins, packed, packed[::-1]):
        assert settled(of, start) == settled_by_trying(of, start)


def settled_by_trying(of: Problem, bins: Bins) -> Bins:
    """Settle blocks by trying every move, with each load added up anew."""
    bins, traffic = [list(blocks) for blocks in bins], pairs(of)
    while sum(tried(of, traffic, bins, block) for block in range(len(of.loads))):
        pass
    return [blocks for blocks in bins if blocks]


def tried(of: Problem, traffic: np.ndarray, bins: Bins, block: int) -> bool:
    home = next(blocks for blocks in bins if block in blocks)
    spikes = [traffic[block, blocks].sum() for blocks in bins]
    left = [b for b in home if b != block]
    for core in np.argsort(np.negative(spikes), kind="stable"):
        there = bins[core]
        if spikes[core] <= traffic[block, home].sum():
            continue
        if of.fits([*there, block]):
            home[:] = left
            there.append(block)
            return True
        for other in there:
            rest = [b for b in there if b != other]
            new = [*left, other], [*rest, block]
            if kept(traffic, new) > kept(traffic, [home, there]) and all(map(of.fits, new)):
                home[:], there[:] = new
                return True
    return False


def kept(traffic: np.ndarray, bins: Iterable[list[int]]) -> float:
    return sum(float(traffic[np.ix_(blocks, blocks)].sum()) for blocks in bins)


def test_swaps_with_equal_blocks_are_checked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    few, many = (n_joins(n, monkeypatch) for n in (20, 80))
    assert many < 4**1.2 * few


def test_gains_of_swaps_with_all_blocks_of_a_core_are_counted_in_one_call(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Blocks of the smaller core would move to the other, but that is full; swaps gain nothing."""
    of = problem(*[1] * 79, room=cores_of(40), audiences={tuple(range(79)): 3})
    bins = [list(range(40)), list(range(40, 79))]
    spikes, gains = [], []
    count, gain = CoreTraffic.spikes, Gains.of
    monkeypatch.setattr(CoreTraffic, "spikes", lambda *of: spikes.append(1) or count(*of))
    monkeypatch.setattr(Gains, "of", lambda *of: gains.append(1) or gain(*of))
    assert settled(of, bins) == bins
    assert len(spikes) == 79
    assert len(gains) == 39


def test_blocks_that_the_same_sources_reach_move_to_one_core() -> None:
    of = problem(5, 5, 5, 5, audiences={(0, 2): 3, (1, 2, 3): 2})
    assert sorted(map(sorted, settled(of, [[0, 1], [2, 3]]))) == [[0, 2], [1, 3]]


def n_joins(n: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return the number of joined loads if each of n blocks could swap with n, and none fits."""
    sizes = [1] * n + [2] * (n // 2)
    partners = {(small, n + small // 2): 1 for small in range(n)}
    of = problem(*sizes, room=cores_of(n), traffic=partners)
    bins = [list(range(n)), list(range(n, len(sizes)))]
    joins = []
    join = Load.joined
    with monkeypatch.context() as patch:
        patch.setattr(Load, "joined", lambda *both: joins.append(1) or join(*both))
        assert settled(of, bins) == bins
    return len(joins)
