import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spikeport.compile.placing.core_traffic import CoreTraffic
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import pairs, problems


@pytest.mark.slow
@given(problems(), st.lists(st.tuples(st.integers(0, 9), st.integers(0, 2)), max_size=30))
@settings(max_examples=100)
def test_spikes_follow_blocks_from_core_to_core(of: Problem, moves: list[tuple[int, int]]) -> None:
    between, n = pairs(of), len(of.loads)
    traffic = CoreTraffic(of, [[block] for block in range(n // 2)])
    core = {block: block for block in range(n // 2)}
    for block, home in moves:
        if block < n:
            traffic.move(block, home)
            core[block] = home
    assert traffic.core == core
    for block in range(n):
        expected = {
            number: sum(between[block, other] for other, at in core.items() if at == number)
            for number in set(core.values())
        }
        found = traffic.spikes(block)
        assert {number: found.get(number, 0) for number in expected} == expected
