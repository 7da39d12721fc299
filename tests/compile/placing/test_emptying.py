import pytest
from hypothesis import given, settings

from spikeport.compile.placing.emptying import EXCHANGES, Emptying, emptied
from spikeport.compile.placing.load import Load
from spikeport.compile.placing.packing import filled, first
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import load, problem, problems


class AskingAll(Emptying):
    """Attempts that check all cores for room, without results of earlier attempts."""

    def _third_has_room(self, core: int, other: int) -> bool:
        return len(self._room_for(other, but=core)) > 0


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
    """The block of the emptiest core could replace either other block, as these fit together."""
    of = problem(load(4, in_axons=6), load(6), load(5, in_axons=5))
    assert emptied(of, [[0], [1], [2]]) == [[1, 0], [2]]


def test_the_emptiest_core_that_can_be_emptied_is_emptied_first() -> None:
    of = problem(load(2, clipping=0b10), load(3, clipping=0b01), load(4, clipping=0b01))
    assert emptied(of, [[0], [1], [2]]) == [[0], [2, 1]]


def test_no_more_exchanges_than_allowed_are_tried() -> None:
    """Without exchanges the emptiest core stays, and the blocks of another core find room."""
    of, bins = problem(5, 4, 6, 5), [[0, 1], [2], [3]]
    assert emptied(of, bins, exchanges=1) == [[0, 3], [2, 1]]
    assert emptied(of, bins, exchanges=0) == [[2, 1], [3, 0]]


def test_loads_of_cores_are_added_up_once_for_all_attempts(
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
@settings(max_examples=150)
@given(of=problems(most_blocks=14))
def test_room_known_from_earlier_attempts_does_not_change_the_result(of: Problem) -> None:
    bins = filled(of, range(len(of.loads)), first)
    for victim in range(len(bins)):
        attempts = [kind(of, bins, EXCHANGES) for kind in (Emptying, AskingAll)]
        assert attempts[0].without(victim) == attempts[1].without(victim)
        assert attempts[0].left == attempts[1].left
