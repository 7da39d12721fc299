import numpy as np

from spikeport.compile.placing.cores import Cores
from tests.helpers.packing_problems import load, problem


def test_a_block_goes_to_a_core_with_room_or_to_a_new_one() -> None:
    of = problem(6, 3, 5, 4)
    cores = Cores(of, [[0], [1]])
    assert cores.with_room(2).tolist() == [1]
    cores.put(1, 2)
    assert cores.with_room(3).tolist() == [0]
    cores.put(2, 3)
    assert cores.bins == [[0], [1, 2], [3]]
    assert cores.loads == [load(6), load(8), load(4)]


def test_setting_the_blocks_of_a_core_changes_its_room() -> None:
    of = problem(6, 5, 4)
    cores = Cores(of, [[0], [1]])
    assert cores.with_room(2).tolist() == [0, 1]
    cores.set(1, [1, 1], load(10))
    assert cores.with_room(2).tolist() == [0]


def test_cores_do_not_change_the_packing_they_start_from() -> None:
    bins = [[0]]
    Cores(problem(1, 1), bins).put(0, 1)
    assert bins == [[0]]


def test_spikes_count_only_blocks_that_are_on_cores_already() -> None:
    of = problem(1, 1, 1, traffic={(0, 2): 3}, audiences={(0, 1, 2): 4})
    cores = Cores(of, [[0]])
    both = np.arange(2)
    assert cores.spikes(2, both[:1]).tolist() == [7]
    cores.put(1, 1)
    assert cores.spikes(2, both).tolist() == [7, 4]
    cores.set(1, [1, 0], load(2))
    assert cores.spikes(2, both).tolist() == [0, 11]
