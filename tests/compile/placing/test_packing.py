import copy

import pytest
from hypothesis import given, settings

from spikeport.compile.placing.load import Load
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.packing import (
    CHOICES,
    CoreChoice,
    filled,
    first,
    fullest,
    most_alike,
    most_traffic,
    orders,
    pack,
)
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import (
    HARD,
    ROOM,
    assert_packed,
    cores_of,
    load,
    problem,
    problems,
)


@pytest.mark.parametrize(("choice", "bins"), [(first, [[0, 2], [1]]), (fullest, [[0], [1, 2]])])
def test_the_first_core_or_the_fullest_takes_a_block(choice: CoreChoice, bins: object) -> None:
    assert filled(problem(5, 6, 4), [0, 1, 2], choice) == bins


def test_the_core_with_most_of_the_profiles_of_a_block_takes_it() -> None:
    of = problem(load(6, thresholds=0b01), load(5, thresholds=0b10), load(3, thresholds=0b10))
    assert filled(of, [0, 1, 2], fullest) == [[0, 2], [1]]
    assert filled(of, [0, 1, 2], most_alike) == [[0], [1, 2]]


def test_only_profiles_that_a_block_would_add_to_a_core_count() -> None:
    of = problem(load(5, thresholds=0b11), load(6), load(3, thresholds=0b01))
    assert filled(of, [0, 1, 2], most_alike) == [[0, 2], [1]]


def test_the_fullest_of_equally_alike_cores_takes_a_block() -> None:
    of = problem(*(load(n, thresholds=0b1) for n in (5, 6, 3)))
    assert filled(of, [0, 1, 2], most_alike) == [[0], [1, 2]]


def test_the_core_that_a_block_exchanges_most_spikes_with_takes_it() -> None:
    of = problem(5, 6, 4, traffic={(0, 2): 2, (1, 2): 1})
    assert filled(of, [0, 1, 2], fullest) == [[0], [1, 2]]
    assert filled(of, [0, 1, 2], most_traffic) == [[0, 2], [1]]


def test_the_fullest_of_cores_with_equal_traffic_takes_a_block() -> None:
    assert filled(problem(5, 6, 4), [0, 1, 2], most_traffic) == [[0], [1, 2]]


def test_a_block_that_fits_on_no_core_opens_a_new_core() -> None:
    assert filled(problem(5, 6, 6), [2, 0, 1], first) == [[2], [0], [1]]


def test_orders_of_blocks_are_as_given_and_largest_first_by_each_measure() -> None:
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


def test_the_order_by_profiles_keeps_equal_profiles_together_then_sorts_by_size() -> None:
    of = problem(load(7, thresholds=0b10), load(6, thresholds=0b01), load(8, thresholds=0b10))
    assert orders(of)[1:3] == [[2, 0, 1], [1, 2, 0]]


def test_only_loads_that_fit_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    of = problem(*(load(1, thresholds=1 << number) for number in range(100)))
    joins: list[tuple[Load, ...]] = []
    join = Load.joined
    monkeypatch.setattr(Load, "joined", lambda *both: joins.append(both) or join(*both))
    for choice in CHOICES:
        assert len(filled(of, range(100), choice)) == 50
    # 100 joins for the union of all, and one for every second block, which finds a core with room.
    assert len(joins) == 100 + 50 * len(CHOICES)


def test_the_packing_of_the_best_rule_is_taken() -> None:
    assert len(filled(problem(4, 4, 6, 6), [0, 1, 2, 3], first)) == 3
    assert len(pack(problem(4, 4, 6, 6), effort=0)) == 2


def test_the_packing_with_most_spikes_within_cores_wins_at_equal_core_counts() -> None:
    of = problem(6, 6, 4, 4, traffic={(0, 3): 1, (1, 2): 1})
    assert filled(of, [0, 1, 2, 3], first) == [[0, 2], [1, 3]]
    assert sorted(map(sorted, pack(of, effort=0))) == [[0, 3], [1, 2]]


def test_a_block_too_large_for_any_core_gets_a_core_of_its_own() -> None:
    assert sorted(map(sorted, pack(problem(11, 5, 5), effort=1))) == [[0], [1, 2]]


def test_effort_empties_cores() -> None:
    of = problem(*HARD, room=cores_of(50))
    assert len(pack(of, effort=0)) == 3
    assert len(pack(of, effort=1)) == 2
    assert_packed(of, pack(of, effort=1))


@pytest.mark.slow
@given(problems())
@settings(max_examples=75)
def test_every_packing_keeps_all_limits(of: Problem) -> None:
    simple, emptied = (pack(of, effort) for effort in (0, 1))
    for bins in (simple, emptied):
        assert_packed(of, bins)
        assert len(bins) >= lower_bound(of.loads, of.room)["cores"]
    assert len(emptied) <= len(simple)
    assert pack(copy.deepcopy(of), 1) == emptied
