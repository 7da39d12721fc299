"""Which sources of which input spike."""

import numpy as np

from spikeport.backends.outbox import Outbox


def test_spikes_are_listed_input_by_input() -> None:
    values = np.zeros(9)
    outbox = Outbox(values, [4, 0, 5])
    outbox.parts[0][[0, 3]] = 1000.0
    outbox.parts[2][[1, 2]] = [-1.0, 0.5]
    assert [spikes.tolist() for spikes in outbox.spikes()] == [[0, 3], [], [1, 2]]
    assert np.count_nonzero(values) == 4


def test_nothing_is_left_of_the_step_before() -> None:
    values = np.ones(3)
    outbox = Outbox(values, [3])
    before = outbox.spikes()[0]
    values[:] = [0, 1, 0]
    assert outbox.spikes()[0].tolist() == [1]
    assert before.tolist() == [0, 1, 2]


def test_a_host_may_have_no_inputs() -> None:
    assert Outbox(np.zeros(0), []).spikes() == []
