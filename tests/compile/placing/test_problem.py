import sys

import numpy as np
import pytest
from hypothesis import given, settings

from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Problem
from tests.helpers.packing_problems import load, pairs, problem, problems


def test_cost_counts_cores_first_then_spikes_within_cores() -> None:
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


def test_blocks_fit_on_a_core_if_every_resource_suffices() -> None:
    full = load(10, thresholds=0b11, clipping=0b1, in_axons=10)
    for more in (load(1), load(in_axons=1), load(thresholds=0b100), load(clipping=0b10)):
        of = problem(full, more)
        assert of.fits([0])
        assert not of.fits([0, 1])
    assert problem(full, load(thresholds=0b1, clipping=0b1)).fits([0, 1])


@pytest.mark.slow
@given(problems())
@settings(max_examples=30)
def test_the_cost_counts_spikes_of_pairs_and_of_audiences(of: Problem) -> None:
    between, bins = pairs(of), pack(of, 0)
    assert of.cost(bins)[1] == -sum(between[np.ix_(blocks, blocks)].sum() for blocks in bins)
