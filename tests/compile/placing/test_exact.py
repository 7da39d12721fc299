import sys

import pytest
from hypothesis import given, settings

from spikeport.compile.placing import exact
from spikeport.compile.placing.exact import pack_exactly
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.errors import MissingExtraError
from tests.helpers.packing_problems import (
    HARD,
    assert_packed,
    cores_of,
    fewest_cores,
    load,
    problem,
    problems,
)


@pytest.fixture
def ortools() -> None:
    pytest.importorskip("ortools", reason="the exact packing needs the extra 'optimal' (ortools)")


def apart(of: Problem) -> Bins:
    return [[block] for block in range(len(of.loads))]


@pytest.mark.usefixtures("ortools")
def test_the_fewest_cores_are_found_and_proved() -> None:
    of = problem(*HARD, room=cores_of(50))
    known = pack(of, effort=0)
    found = pack_exactly(of, known)
    assert (len(known), len(found.bins), found.at_least) == (3, 2, 2)
    assert_packed(of, found.bins)


@pytest.mark.usefixtures("ortools")
def test_a_bound_above_the_sums_of_amounts_is_proved() -> None:
    of = problem(*[3] * 5, room=cores_of(8))
    found = pack_exactly(of, apart(of))
    assert (len(found.bins), found.at_least) == (3, 3)


@pytest.mark.usefixtures("ortools")
def test_the_exact_packing_keeps_the_limit_of_profiles() -> None:
    sizes, masks = (3, 4, 4, 3, 4), (0b001, 0b010, 0b010, 0b100, 0b010)
    found = pack_exactly(of := problem(*sizes), apart(of))
    assert (len(found.bins), found.at_least) == (2, 2)
    found = pack_exactly(of := problem(*map(load, sizes, masks)), apart(of))
    assert_packed(of, found.bins)
    assert (len(found.bins), found.at_least) == (3, 3)


@pytest.mark.usefixtures("ortools")
def test_a_search_that_finds_nothing_in_time_returns_the_known_packing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(exact, "SEARCH", 1e-3)
    of = problem(*HARD, *HARD, *HARD, room=cores_of(50))
    known = pack(of, effort=0)
    found = pack_exactly(of, known)
    assert found.bins == known
    assert found.at_least < len(known)


def test_a_packing_that_meets_the_bound_needs_no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    known = [[1], [0]]
    assert pack_exactly(problem(6, 6), known) == (known, 2)


def test_a_packing_with_a_block_that_fits_no_core_is_returned_without_a_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    of = problem(11, 3, 3)
    assert pack_exactly(of, apart(of)) == (apart(of), 2)


def test_the_error_names_the_extra_if_ortools_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    with pytest.raises(MissingExtraError) as caught:
        pack_exactly(problem(3, 3), [[0], [1]])
    assert str(caught.value) == (
        "pack{exact=true} needs the package ortools, which is absent; "
        "install it with: pip install 'spikeport[optimal]'"
    )


@pytest.mark.slow
@pytest.mark.usefixtures("ortools")
@given(problems(most_blocks=6))
@settings(max_examples=40)
def test_no_packing_takes_fewer_cores_than_the_exact_one(of: Problem) -> None:
    known = pack(of, effort=1)
    found = pack_exactly(of, known)
    assert_packed(of, found.bins)
    assert len(found.bins) == found.at_least == fewest_cores(of) <= len(known)
    assert pack_exactly(of, known) == found
