import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.compile.placing.load import Load
from spikeport.compile.placing.lower_bound import lower_bound, sums
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import ROOM, cores_of, fewest_cores, load, problem, problems

AMOUNTS = ("compartments", "in_axons", "out_axons", "synapse_bits")
PROFILES = ("compartment_profiles", "threshold_profiles", "synapse_profiles")


@pytest.mark.parametrize("kind", range(4))
def test_every_amount_is_summed(kind: int) -> None:
    amounts = tuple(7 if k == kind else 0 for k in range(4))
    found = sums([Load(amounts)] * 3, ROOM)
    assert found == dict.fromkeys(AMOUNTS + PROFILES, 0) | {AMOUNTS[kind]: 3}


@pytest.mark.parametrize("kind", range(3))
def test_distinct_profiles_are_counted_once(kind: int) -> None:
    masks = [tuple(mask if k == kind else 0 for k in range(6)) for mask in (0b1, 0b10, 0b10, 0b100)]
    found = sums([Load(profiles=profiles) for profiles in masks], ROOM)
    assert found == dict.fromkeys(AMOUNTS + PROFILES, 0) | {PROFILES[kind]: 2}


def test_an_amount_without_a_limit_takes_no_core() -> None:
    assert sums([load(in_axons=10**9)], cores_of(10))["in_axons"] == 0


def test_blocks_of_which_no_two_fit_together_take_a_core_each() -> None:
    found = lower_bound(problem(6, 6, 6).loads, ROOM)
    assert (found["compartments"], found["apart"], found["cores"]) == (2, 3, 3)


def test_blocks_with_different_settings_of_the_core_take_a_core_each() -> None:
    loads = [load(1, clipping=1 << k) for k in range(3)]
    assert lower_bound(loads, ROOM)["apart"] == 3


def test_sets_of_blocks_apart_are_searched_by_every_amount() -> None:
    """Sorted by compartments, the first block comes first, and fits with each of the others."""
    loads = [load(4), load(3, in_axons=6), load(2, in_axons=6)]
    assert lower_bound(loads, ROOM)["apart"] == 2


def test_the_search_for_blocks_apart_starts_with_the_largest() -> None:
    """If the smallest came first, only the largest would not fit beside it: a set of two."""
    assert lower_bound([load(n) for n in (4, 5, 6, 7)], ROOM)["apart"] == 3


def test_the_bound_of_cores_is_the_largest_of_all_bounds() -> None:
    found = lower_bound([load(5)] * 5, ROOM)
    assert found["cores"] == max(n for name, n in found.items() if name != "cores") == 3


def test_a_problem_without_blocks_takes_no_core() -> None:
    assert set(lower_bound([], ROOM).values()) == {0}


@pytest.mark.slow
@given(problems(most_blocks=6))
@settings(max_examples=150)
def test_no_packing_takes_fewer_cores_than_the_lower_bound(of: Problem) -> None:
    assert lower_bound(of.loads, of.room)["cores"] <= fewest_cores(of)


def test_an_amount_of_infinite_room_gives_a_bound_of_0() -> None:
    assert lower_bound([load(3)], cores_of(np.inf))["compartments"] == 0
