import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.compile.placing.gains import Gains
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import problem, problems


def test_a_swap_gains_spikes_of_pairs_and_of_audiences() -> None:
    of = problem(1, 1, 1, 1, traffic={(0, 2): 4, (1, 3): 1}, audiences={(0, 1): 2})
    bins = [[0, 1], [2, 3]]
    gains = Gains(of.traffic, bins)
    assert gains.of(0, 0, 1).tolist() == [4 * 0 + 1 * 0 - 2, 4 + 1 - 2]
    assert gains.of(2, 1, 0).tolist() == [-2, 4 + 1 - 2]


def test_gains_change_with_the_blocks_of_cores() -> None:
    of = problem(1, 1, 1, traffic={(0, 1): 3})
    gains = Gains(of.traffic, [[0], [1, 2]])
    assert gains.of(0, 0, 1).tolist() == [0, 3]
    gains.put(0, [2])
    gains.put(1, [1, 0])
    assert gains.of(2, 0, 1).tolist() == [-3, -3]


@pytest.mark.slow
@given(problems())
@settings(max_examples=60)
def test_gains_are_the_rise_of_spikes_within_cores(of: Problem) -> None:
    bins = pack(of, 0)
    gains = Gains(of.traffic, bins)
    for home, ours in enumerate(bins):
        for core, theirs in enumerate(bins):
            if core != home:
                expected = [swap_gain(of, ours, theirs, other) for other in theirs]
                np.testing.assert_array_equal(gains.of(ours[0], home, core), expected)


def swap_gain(of: Problem, ours: list[int], theirs: list[int], other: int) -> float:
    """Return the rise of spikes within two cores, each pair once, for two blocks."""
    swapped = [[other, *ours[1:]], [ours[0], *(block for block in theirs if block != other)]]
    return (of.cost([ours, theirs])[1] - of.cost(swapped)[1]) / 2
