"""Partitions of ensembles into groups of parts."""

import nengo
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spikeport.compile.rewriting.partition import Part, Partition, Position, in_parts
from tests.helpers.small_networks import ensemble


def ensembles(*sizes: int) -> list[nengo.Ensemble]:
    with nengo.Network():
        return [nengo.Ensemble(n, 1) for n in sizes]


def test_places_lay_neurons_and_dimensions_of_a_group_end_to_end() -> None:
    with nengo.Network():
        a, b, c = ensemble("a", 4, 2), ensemble("b", 6, 3), ensemble("c", 5, 1)
    parts = [Part(a, 0, 4), Part(b, 2, 6), Part(c, 0, 5), Part(b, 0, 2)]
    partition = Partition([parts[:3], parts[3:]])
    assert partition.places == {
        a: [Position(parts[0], 0, 0, 0)],
        b: [Position(parts[1], 0, 4, 2), Position(parts[3], 1, 0, 0)],
        c: [Position(parts[2], 0, 8, 5)],
    }
    assert partition.n_neurons == [13, 2]
    assert partition.dimensions == [6, 3]


def test_a_partition_contains_its_ensembles() -> None:
    a, b = ensembles(3, 3)
    partition = Partition([[Part(a, 0, 3)]])
    assert a in partition
    assert b not in partition
    assert a.neurons not in partition


def test_the_radius_of_a_group_is_the_largest() -> None:
    with nengo.Network():
        small, large = ensemble("small", 3, radius=0.5), ensemble("large", 3, radius=2)
    partition = Partition([[Part(small, 0, 3), Part(large, 0, 3)], [Part(small, 0, 3)]])
    assert partition.radius == [2, 0.5]


def sizes(members: list[nengo.Ensemble], most: float) -> list[list[int]]:
    return [[part.size for part in group] for group in in_parts(members, most)]


@pytest.mark.parametrize(
    ("members", "most", "groups"),
    [
        ((3, 4, 5), 8, [[3, 4], [5]]),
        ((3, 5, 5, 3), 8, [[3, 5], [5, 3]]),
        ((9,), 8, [[4], [5]]),
        ((10,), 4, [[3], [3], [4]]),
        ((2, 9, 2), 8, [[2], [4], [5], [2]]),
        ((8, 1), 8, [[8], [1]]),
        ((3, 3), float("inf"), [[3, 3]]),
    ],
)
def test_groups_hold_no_more_neurons_than_allowed(
    members: tuple[int, ...], most: float, groups: list[list[int]]
) -> None:
    assert sizes(ensembles(*members), most) == groups


@given(st.lists(st.integers(1, 20), max_size=8), st.integers(1, 12))
def test_every_neuron_is_in_one_part(members: list[int], most: int) -> None:
    these = ensembles(*members)
    groups = in_parts(these, most)
    found = [(p.ensemble, n) for group in groups for p in group for n in range(p.start, p.stop)]
    assert found == [(e, n) for e in these for n in range(e.n_neurons)]
    for group in groups:
        assert 0 < sum(part.size for part in group) <= most
        assert len(group) == 1 or all(part.size == part.ensemble.n_neurons for part in group)
