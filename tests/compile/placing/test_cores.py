from spikeport.compile.placing.cores import Cores
from tests.helpers.packing_problems import load, problem


def test_a_block_goes_to_a_core_with_room_or_to_a_new_one() -> None:
    of = problem(6, 3, 5, 4)
    cores = Cores(of, [[0], [1]])
    assert cores.with_room(2) == {1: load(8)}
    cores.put(1, 2, load(8))
    assert cores.with_room(3) == {0: load(10)}
    cores.put(2, 3, of.loads[3])
    assert cores.bins == [[0], [1, 2], [3]]
    assert cores.loads == [load(6), load(8), load(4)]


def test_a_core_that_is_set_has_other_room() -> None:
    of = problem(6, 5, 4)
    cores = Cores(of, [[0], [1]])
    assert cores.with_room(2) == {0: load(10), 1: load(9)}
    cores.set(1, [1, 1], load(10))
    assert list(cores.with_room(2)) == [0]


def test_cores_leave_the_packing_they_start_from() -> None:
    bins = [[0]]
    Cores(problem(1, 1), bins).put(0, 1, load(2))
    assert bins == [[0]]
