import copy
import sys

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.compile.placing.load import Load
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.packing import (
    CHOICES,
    CoreChoice,
    Problem,
    emptied,
    filled,
    first,
    fullest,
    most_alike,
    most_traffic,
    orders,
    pack,
)
from tests.helpers.packing_problems import (
    HARD,
    ROOM,
    assert_packed,
    cores_of,
    load,
    pairs,
    problem,
    problems,
)


def test_cost_counts_cores_first_then_spikes_between_them() -> None:
    of = problem(1, 1, 1, traffic={(0, 1): 3, (1, 2): 5})
    assert of.cost([[0, 1], [2]]) == (2, -6)
    assert of.cost([[0], [1, 2]]) == (2, -10)
    assert min([[0, 1, 2]], [[0], [1, 2]], key=of.cost) == [[0, 1, 2]]


def test_the_cost_of_many_audiences_takes_no_more_calls_than_that_of_few() -> None:
    def n_calls(n: int) -> int:
        of = problem(*[1] * n, audiences={(i, i + 1): 1 for i in range(n - 1)})
        calls: list[object] = []
        sys.setprofile(lambda *event: calls.append(event[1]))
        of.cost([list(range(n))])
        sys.setprofile(None)
        return calls.count("call")

    assert n_calls(200) <= n_calls(20)


def test_blocks_fit_as_far_as_every_resource_reaches() -> None:
    full = load(10, thresholds=0b11, clipping=0b1, in_axons=10)
    for more in (load(1), load(in_axons=1), load(thresholds=0b100), load(clipping=0b10)):
        of = problem(full, more)
        assert of.fits([0])
        assert not of.fits([0, 1])
    assert problem(full, load(thresholds=0b1, clipping=0b1)).fits([0, 1])


@pytest.mark.parametrize(("choice", "bins"), [(first, [[0, 2], [1]]), (fullest, [[0], [1, 2]])])
def test_the_first_core_or_the_fullest_takes_a_block(choice: CoreChoice, bins: object) -> None:
    assert filled(problem(5, 6, 4), [0, 1, 2], choice) == bins


def test_the_core_with_most_of_its_profiles_takes_a_block() -> None:
    of = problem(load(6, thresholds=0b01), load(5, thresholds=0b10), load(3, thresholds=0b10))
    assert filled(of, [0, 1, 2], fullest) == [[0, 2], [1]]
    assert filled(of, [0, 1, 2], most_alike) == [[0], [1, 2]]


def test_profiles_that_a_core_has_already_do_not_count() -> None:
    of = problem(load(5, thresholds=0b11), load(6), load(3, thresholds=0b01))
    assert filled(of, [0, 1, 2], most_alike) == [[0, 2], [1]]


def test_of_cores_equally_alike_the_fullest_takes_a_block() -> None:
    of = problem(*(load(n, thresholds=0b1) for n in (5, 6, 3)))
    assert filled(of, [0, 1, 2], most_alike) == [[0], [1, 2]]


def test_the_core_it_exchanges_most_spikes_with_takes_a_block() -> None:
    of = problem(5, 6, 4, traffic={(0, 2): 2, (1, 2): 1})
    assert filled(of, [0, 1, 2], fullest) == [[0], [1, 2]]
    assert filled(of, [0, 1, 2], most_traffic) == [[0, 2], [1]]


def test_of_cores_with_equal_traffic_the_fullest_takes_a_block() -> None:
    assert filled(problem(5, 6, 4), [0, 1, 2], most_traffic) == [[0], [1, 2]]


def test_a_block_without_room_anywhere_opens_a_core() -> None:
    assert filled(problem(5, 6, 6), [2, 0, 1], first) == [[2], [0], [1]]


def test_blocks_come_as_they_are_and_largest_first_by_each_measure() -> None:
    room = ROOM._replace(amounts=(10, 20, 10, 10))
    of = problem(
        load(4, thresholds=0b10),
        load(1, thresholds=0b01, in_axons=18),
        load(6, thresholds=0b10, in_axons=2),
        room=room,
    )
    as_they_are, by_fill, by_profiles, by_compartments, by_axons, *rest = orders(of)
    assert as_they_are == [0, 1, 2]
    assert by_fill == [1, 2, 0]
    assert by_profiles == [1, 2, 0]
    assert by_compartments == [2, 0, 1]
    assert by_axons == [1, 2, 0]
    assert rest == [[0, 1, 2]] * 2  # equal ones stay in order


def test_profiles_come_together_before_size() -> None:
    of = problem(load(7, thresholds=0b10), load(6, thresholds=0b01), load(8, thresholds=0b10))
    assert orders(of)[1:3] == [[2, 0, 1], [1, 2, 0]]


def test_only_loads_that_fit_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    of = problem(*(load(1, thresholds=1 << number) for number in range(100)))
    joins: list[tuple[Load, ...]] = []
    join = Load.joined
    monkeypatch.setattr(Load, "joined", lambda *both: joins.append(both) or join(*both))
    for choice in CHOICES:
        assert len(filled(of, range(100), choice)) == 50
    # Once for the union of all; then every second block finds one core with room.
    assert len(joins) == 100 + 50 * len(CHOICES)


def test_the_best_of_all_rules_is_taken() -> None:
    assert len(filled(problem(4, 4, 6, 6), [0, 1, 2, 3], first)) == 3
    assert len(pack(problem(4, 4, 6, 6), effort=0)) == 2


def test_of_packings_on_as_many_cores_the_one_with_most_spikes_within_is_taken() -> None:
    of = problem(6, 6, 4, 4, traffic={(0, 3): 1, (1, 2): 1})
    assert filled(of, [0, 1, 2, 3], first) == [[0, 2], [1, 3]]
    assert sorted(map(sorted, pack(of, effort=0))) == [[0, 3], [1, 2]]


def test_what_fits_no_core_gets_one_of_its_own() -> None:
    assert sorted(map(sorted, pack(problem(11, 5, 5), effort=1))) == [[0], [1, 2]]


def test_effort_empties_cores() -> None:
    of = problem(*HARD, room=cores_of(50))
    assert len(pack(of, effort=0)) == 3
    assert len(pack(of, effort=1)) == 2
    assert_packed(of, pack(of, effort=1))


def test_a_core_is_emptied_into_the_room_of_others() -> None:
    of = problem(7, 6, 2, 3)
    assert emptied(of, [[0], [1], [2, 3]]) == [[0, 3], [1, 2]]


def test_a_block_takes_the_place_of_a_smaller_one_that_fits_elsewhere() -> None:
    of = problem(5, 4, 6, 5)
    assert emptied(of, [[0, 1], [2], [3]]) == [[0, 3], [2, 1]]


def test_cores_are_emptied_one_after_another() -> None:
    assert emptied(problem(2, 2, 2, 2), [[0], [1], [2], [3]]) == [[1, 0, 2, 3]]


def test_a_core_that_cannot_be_emptied_keeps_its_blocks() -> None:
    of = problem(6, 6, 2, 5)
    assert emptied(of, [[0, 2], [1], [3]]) == [[0, 2], [1], [3]]


def test_only_smaller_blocks_make_room() -> None:
    """The last, which is tried first, could take the place of either, which fit together."""
    of = problem(load(4, in_axons=6), load(6), load(5, in_axons=5))
    assert emptied(of, [[0], [1], [2]]) == [[1, 0], [2]]


def test_the_emptiest_core_that_can_be_emptied_is() -> None:
    of = problem(load(2, clipping=0b10), load(3, clipping=0b01), load(4, clipping=0b01))
    assert emptied(of, [[0], [1], [2]]) == [[0], [2, 1]]


def test_exchanges_are_tried_as_often_as_is_said() -> None:
    """Without any, the emptiest core stays, and the blocks of another find room."""
    of, bins = problem(5, 4, 6, 5), [[0, 1], [2], [3]]
    assert emptied(of, bins, exchanges=2) == [[0, 3], [2, 1]]
    assert emptied(of, bins, exchanges=0) == [[2, 1], [3, 0]]


def test_loads_of_cores_are_not_counted_anew_for_each_that_is_emptied(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = problem(*(load(6, thresholds=1 << number) for number in range(50)))
    joins: list[tuple[Load, ...]] = []
    join = Load.joined
    monkeypatch.setattr(Load, "joined", lambda *both: joins.append(both) or join(*both))
    bins = [[block] for block in range(50)]
    assert emptied(of, bins) == bins
    assert len(joins) == 100  # once for each core, and once for the union of all


@pytest.mark.slow
@given(problems())
@settings(deadline=None, max_examples=150)
def test_every_packing_keeps_all_limits(of: Problem) -> None:
    for effort in (0, 1):
        bins = pack(of, effort)
        assert_packed(of, bins)
        assert len(bins) >= lower_bound(of.loads, of.room)["cores"]
        assert pack(copy.deepcopy(of), effort) == bins
    assert len(pack(of, 1)) <= len(pack(of, 0))


def test_traffic_is_of_pairs() -> None:
    of = problem(1, 1, traffic={(0, 1): 2})
    np.testing.assert_array_equal(of.traffic.direct.toarray(), [[0, 2], [2, 0]])


@given(problems())
@settings(deadline=None, max_examples=30)
def test_the_cost_counts_spikes_of_pairs_and_of_audiences(of: Problem) -> None:
    between, bins = pairs(of), pack(of, 0)
    assert of.cost(bins)[1] == -sum(between[np.ix_(blocks, blocks)].sum() for blocks in bins)
    for blocks in bins:
        expected = between[blocks[0], blocks].sum()
        assert of.exchanged(blocks[0], [b for b in blocks if b != blocks[0]]) == expected
