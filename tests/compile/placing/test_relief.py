import numpy as np
import pytest

from spikeport.compile.placing import relief
from spikeport.compile.placing.relief import BUSIEST, Messages, Relief
from spikeport.hardware_models.links import Links
from tests.helpers.same_run import small_chip


def random_messages(n: int, seed: int) -> Messages:
    """Return three messages of each core to others, or to itself."""
    rng = np.random.RandomState(seed)
    dense = np.zeros((n, n), dtype=int)
    np.add.at(dense, (np.repeat(np.arange(n), 3), rng.randint(n, size=3 * n)), 1)
    source, target = np.nonzero(dense)
    return Messages(source, target, dense[source, target] * rng.randint(1, 9, len(source)))


def relieved_by_trying(messages: Messages, links: Links, order: np.ndarray) -> np.ndarray:
    """Swap each of the busiest cores with every other, and count the cost of messages anew."""
    source, target, number = messages

    def cost(order: np.ndarray):
        place = np.argsort(order)
        return links.cost(place[source], place[target], number)

    apart = source != target
    ends = np.concatenate([source[apart], target[apart]])
    busy = np.bincount(ends, np.tile(number[apart], 2), minlength=len(order))
    order, best = order.copy(), cost(order)
    for core in np.argsort(-busy, kind="stable")[:BUSIEST]:
        for place in range(len(order)):
            swapped = order.copy()
            swapped[[np.flatnonzero(order == core)[0], place]] = order[place], core
            if cost(swapped) < best:
                order, best = swapped, cost(swapped)
    return order


@pytest.mark.parametrize(("cores", "together"), [(128, 256), (10, 7)])
def test_cores_are_swapped_where_that_lowers_the_cost_of_all_messages(
    cores: int, together: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cores are on one chip, or on three, where messages between chips count first."""
    monkeypatch.setattr(relief, "TOGETHER", together)
    n = 24
    links = Links(n, small_chip(cores=cores, chips=4))
    for seed in range(2):
        messages, order = random_messages(n, seed), np.random.RandomState(seed).permutation(n)
        found = Relief(messages, links, n).relieved(order)
        assert found.tolist() == relieved_by_trying(messages, links, order).tolist()
        assert found.tolist() != order.tolist()


def test_cores_without_messages_stay() -> None:
    none = Messages(*(np.zeros(0, dtype=int) for _ in range(3)))
    order = np.array([2, 0, 1])
    assert Relief(none, Links(3, small_chip()), 3).relieved(order).tolist() == [2, 0, 1]


def test_judging_a_swap_routes_only_the_messages_of_its_two_cores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few, many = (n_routed(n, monkeypatch) for n in (128, 512))
    assert many < 4**1.2 * few


def n_routed(n: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return the messages routed to find that no swap helps, in a ring laid along the tiles."""
    ring = Messages(np.arange(n), np.roll(np.arange(n), -1), np.ones(n, dtype=int))
    routed = []
    loads = Links.loads
    with monkeypatch.context() as patch:
        patch.setattr(Links, "loads", lambda me, *a: routed.append(len(a[0])) or loads(me, *a))
        Relief(ring, Links(n, small_chip(chips=4)), n).relieved(np.arange(n))
    return sum(routed)
