import numpy as np
import pytest

from spikeport.compile.placing.emptying import Emptying, emptied
from spikeport.compile.placing.exchange import Exchanges
from spikeport.compile.placing.load import Load
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.compile.placing.tally import Tally
from tests.helpers.packing_problems import cores_of, load, problem


def exchanges(of: Problem, bins: Bins) -> Exchanges:
    tally = Tally(of.room, of.union)
    found = Exchanges(of.loads, of.room, tally)
    for core, blocks in enumerate(bins):
        tally.put(core, of.load(blocks))
        found.put(core, blocks)
    return found


def possible(of: Problem, bins: Bins, wanted: Load) -> list[int]:
    return exchanges(of, bins).possible(wanted, np.arange(len(of.loads))).tolist()


def test_a_block_may_make_room_if_the_load_fits_without_it() -> None:
    of = problem(5, 4, 3, 8)
    assert possible(of, [[0, 1], [2], [3]], load(6)) == [0, 2, 3]
    assert possible(of, [[0, 1], [2], [3]], load(11)) == []


def test_a_block_may_make_room_by_profiles_that_only_it_has() -> None:
    of = problem(*(load(1, thresholds=mask) for mask in (0b01, 0b10, 0b10, 0b100)))
    assert possible(of, [[0, 1, 2], [3]], load(1, thresholds=0b1000)) == [0, 3]


def test_blocks_are_on_the_core_they_were_put_on_last() -> None:
    of = problem(5, 4, 3)
    found = exchanges(of, [[0, 1], [2]])
    found.put(1, [2, 1])
    assert found.core_of(np.array([0, 1, 2])).tolist() == [0, 1, 1]


@pytest.mark.parametrize("seed", range(20))
def test_every_block_that_makes_room_is_among_the_possible_ones(seed: int) -> None:
    """A block that is not among the possible ones cannot make room, whatever its core holds."""
    rng = np.random.RandomState(seed)
    of = problem(
        *(
            load(rng.randint(1, 5), 1 << rng.randint(6), 1 << rng.randint(2), rng.randint(3))
            for _ in range(30)
        )
    )
    bins = pack(of, 0)
    wanted = load(3, thresholds=0b11, clipping=0b1)
    fitting = {
        other
        for blocks in bins
        for other in blocks
        if of.room.holds(of.load(set(blocks) - {other}).joined(wanted))
    }
    found = set(possible(of, bins, wanted))
    assert fitting <= found
    assert len(found - fitting) < len(of.loads) / 3


def test_blocks_that_cannot_make_room_are_not_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    few, many = (n_tried(n, monkeypatch) for n in (20, 80))
    assert many < 4**1.2 * few


def n_tried(n: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return the number of exchanges tried if n cores hold two blocks with all profiles."""
    profiles = (load(size, thresholds=0b11 << 2 * core) for core in range(n) for size in (5, 3))
    of = problem(*profiles, room=cores_of(9)._replace(profiles=(2, 2, 2, 1, 1, 1)))
    bins = [[2 * core, 2 * core + 1] for core in range(n)]
    tried = [1]
    push = Emptying._push
    with monkeypatch.context() as patch:
        patch.setattr(Emptying, "_push", lambda me, *blocks: tried.append(1) or push(me, *blocks))
        assert emptied(of, bins) == bins
    return len(tried)
