import numpy as np
import pytest

from spikeport.compile.placing.savings import Savings


def board(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a ring of cores with some messages more, and the distances of places in a row."""
    rng = np.random.RandomState(seed)
    flow = np.roll(np.eye(n, dtype=int), 1, axis=0) * rng.randint(1, 4, n)
    flow[rng.randint(n, size=n), rng.randint(n, size=n)] += 2
    flow = flow + flow.T
    np.fill_diagonal(flow, 0)
    places = np.arange(n) // 2
    return flow, np.abs(places[:, np.newaxis] - places)


def hops(flow: np.ndarray, distance: np.ndarray, order: np.ndarray) -> int:
    return int((flow[np.ix_(order, order)] * distance).sum() // 2)


def best_by_trying(flow: np.ndarray, distance: np.ndarray, order: np.ndarray):
    """Return the first two places whose swap saves most hops, each swap counted as a whole."""
    n, now = len(order), hops(flow, distance, order)
    saved = np.zeros((n, n), dtype=int)
    for i in range(n):
        for j in range(n):
            swapped = order.copy()
            swapped[[i, j]] = order[[j, i]]
            saved[i, j] = now - hops(flow, distance, swapped)
    best = np.unravel_index(saved.argmax(), saved.shape)
    return best if saved[best] > 0 else None


@pytest.mark.parametrize("seed", range(4))
def test_best_returns_the_first_of_the_best_swaps_after_every_swap(seed: int) -> None:
    flow, distance = board(11, seed)
    savings = Savings(flow, distance, np.random.RandomState(seed).permutation(11))
    swaps = 0
    while (best := savings.best()) is not None:
        assert best == best_by_trying(flow, distance, savings.order)
        savings.swap(*best)
        swaps += 1
    assert best_by_trying(flow, distance, savings.order) is None
    assert swaps > 2


def test_the_order_that_is_passed_is_not_changed() -> None:
    flow, distance = board(8, 0)
    order = np.arange(8)
    Savings(flow, distance, order).swap(0, 7)
    assert order.tolist() == list(range(8))


def test_a_swap_counts_only_the_rows_of_partners_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    few, many = (rows_a_swap(n, monkeypatch) for n in (20, 80))
    assert many < 1.5 * few


def rows_a_swap(n: int, monkeypatch: pytest.MonkeyPatch) -> float:
    flow, distance = board(n, 0)
    savings, rows = Savings(flow, distance, np.random.RandomState(0).permutation(n)), []
    count = Savings._count
    with monkeypatch.context() as patch:
        patch.setattr(Savings, "_count", lambda me, at: rows.append(len(at)) or count(me, at))
        while (best := savings.best()) is not None:
            savings.swap(*best)
    return float(np.mean(rows))
