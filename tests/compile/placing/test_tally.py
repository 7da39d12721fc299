import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.compile.placing.load import Load
from spikeport.compile.placing.problem import Problem
from spikeport.compile.placing.tally import Tally
from tests.helpers.packing_problems import ROOM, load, problems


def test_a_core_has_room_if_every_amount_and_every_kind_of_profile_fits() -> None:
    tally = Tally(ROOM, load(thresholds=0b111, clipping=0b11))
    for core, held in enumerate((load(6), load(1, thresholds=0b11), load(1, clipping=0b1))):
        tally.put(core, held)
    assert tally.with_room(load(5)).tolist() == [1, 2]
    assert tally.with_room(load(4, thresholds=0b10)).tolist() == [0, 1, 2]
    assert tally.with_room(load(4, thresholds=0b100)).tolist() == [0, 2]
    assert tally.with_room(load(4, clipping=0b10)).tolist() == [0, 1]
    assert tally.with_room(load(11)).tolist() == []


def test_a_core_without_blocks_has_room() -> None:
    tally = Tally(ROOM, load(1))
    tally.put(0, Load())
    assert tally.with_room(load(1)).tolist() == [0]


def test_a_tally_without_cores_has_no_room() -> None:
    assert Tally(ROOM, load(1)).with_room(load(1)).tolist() == []


@pytest.mark.slow
@given(problems(), st.lists(st.integers(0, 2), min_size=10, max_size=10))
@settings(max_examples=150)
def test_cores_have_room_where_joined_loads_fit(of: Problem, cores: list[int]) -> None:
    held: list[Load] = []
    tally = Tally(of.room, of.union)
    for new, core in zip(of.loads, cores, strict=False):
        assert tally.with_room(new).tolist() == [
            number for number, one in enumerate(held) if of.room.holds(one.joined(new))
        ]
        if core >= len(held):
            held.append(Load())
        # A core may also lose profiles: odd cores hold only the block that was put on last.
        core = min(core, len(held) - 1)
        held[core] = new if core % 2 else held[core].joined(new)
        tally.put(core, held[core])


@pytest.mark.slow
@given(problems())
@settings(max_examples=150)
def test_fills_and_added_profiles_are_those_of_joined_loads(of: Problem) -> None:
    tally, held = Tally(of.room, of.union), of.loads[::2]
    for core, load_ in enumerate(held):
        tally.put(core, load_)
    some = np.arange(len(held))[::-1]
    for new in of.loads[1::2]:
        after = [held[core].joined(new) for core in some]
        assert tally.fills(new, some).tolist() == [of.room.fill(one) for one in after]
        assert tally.added(new, some).tolist() == [
            sum(
                a.bit_count() - b.bit_count()
                for a, b in zip(one.profiles, held[core].profiles, strict=True)
            )
            for one, core in zip(after, some, strict=True)
        ]
