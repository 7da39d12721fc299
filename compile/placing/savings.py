"""Hops that swaps of two cores save, updated as cores are swapped."""

import numpy as np
from scipy import sparse


class Savings:
    """The hops that the swap of any two cores would save.

    Moving the core of place i to place j costs m_ij = sum_k f_ik d_jk for messages f between cores
    and distances d of places; a swap saves m_ii + m_jj - m_ij - m_ji - 2 f_ij d_ij. A swap changes
    this for the two cores and their partners alone, so only their rows are counted anew.

    Parameters
    ----------
    flow : (n_cores, n_cores) array
        The messages between cores, both ways together; symmetric, 0 on the diagonal.
    distance : (n_cores, n_cores) array
        The hops between places; symmetric.
    order : (n_cores,) array
        The core of each place, which is not changed.
    """

    def __init__(self, flow: np.ndarray, distance: np.ndarray, order: np.ndarray) -> None:
        self._flow, self._distance = flow, distance
        self.order = order.copy()
        places = np.arange(len(order))
        self._moved = sparse.csr_array(flow[np.ix_(order, order)]) @ distance
        self._saved = np.zeros_like(self._moved)
        self._partner = np.zeros_like(places)
        self._most = np.zeros_like(places)
        self._count(places)

    def best(self) -> tuple[int, int] | None:
        """Return the first two places whose swap saves most; None if none saves any."""
        place = int(self._most.argmax())
        return (place, int(self._partner[place])) if self._most[place] > 0 else None

    def swap(self, i: int, j: int) -> None:
        """Swap the cores of two places."""
        from_i, from_j = (self._flow[self.order[place]][self.order] for place in (i, j))
        partners = np.flatnonzero(from_i - from_j)
        step = self._distance[i] - self._distance[j]
        self._moved[partners] += (from_j - from_i)[partners, np.newaxis] * step
        self.order[[i, j]] = self.order[[j, i]]
        for place in (i, j):
            row = self._flow[self.order[place]][self.order]
            sent = np.flatnonzero(row)
            self._moved[place] = row[sent] @ self._distance[sent]
        self._count(np.union1d(partners, (i, j)))

    def _count(self, places: np.ndarray) -> None:
        """Count the hops that swaps with some places save, and update each place's best swap."""
        own = np.diag(self._moved)
        near = self._flow[np.ix_(self.order[places], self.order)] * self._distance[places]
        saved = own[places, np.newaxis] + own - self._moved[places] - self._moved[:, places].T
        saved -= 2 * near
        self._saved[places], self._saved[:, places] = saved, saved.T
        first = places[saved.argmax(axis=0)]
        most = saved.max(axis=0)
        better = (most > self._most) | ((most == self._most) & (first < self._partner))
        # A place whose best partner was one of these is compared with all, if it saves no more now.
        lost = np.isin(self._partner, places) & (most <= self._most)
        lost[places] = True
        self._partner[better], self._most[better] = first[better], most[better]
        self._partner[lost] = self._saved[lost].argmax(axis=1)
        self._most[lost] = self._saved[lost, self._partner[lost]]
