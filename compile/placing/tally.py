"""Loads of many cores as arrays, which show at once which cores have room."""

import numpy as np

from spikeport.compile.placing.load import PROFILES, Capacity, Load


class Tally:
    """The loads of cores, to find the cores with room for one more load, how full they would be
    with it, and how many profiles it would add.

    Most cores have no room, and joining loads is slow: this finds the cores with room by a few
    operations on arrays, whatever their number.

    Attributes
    ----------
    limited : dict of int to float
        The most profiles that a core has, by kind, for kinds whose profiles do not all fit on one
        core.

    Parameters
    ----------
    room : Capacity
        The capacity of a core.
    union : Load
        The load of all blocks together: kinds of profiles that all fit on one core need no account.
    """

    def __init__(self, room: Capacity, union: Load) -> None:
        self._room, self._most = np.array(room.amounts), room.profiles
        self._n_cores = 0
        self._amounts = np.zeros((0, len(room.amounts)), dtype=int)
        self.limited = {
            number: most
            for number, (most, mask) in enumerate(zip(room.profiles, union.profiles, strict=True))
            if mask.bit_count() > most
        }
        self._kinds = {number: _Kind() for number in self.limited}
        self._masks: list[list[int]] = [[] for _ in room.profiles]

    def put(self, core: int, load: Load) -> None:
        """Set the load of a core; the core after the last is new."""
        self._n_cores = max(self._n_cores, core + 1)
        self._amounts = _grown(self._amounts, self._n_cores)
        self._amounts[core] = load.amounts
        for masks, mask in zip(self._masks, load.profiles, strict=True):
            masks[core : core + 1] = [mask]
        for number, kind in self._kinds.items():
            kind.put(core, load.profiles[number])

    def with_room(self, load: Load) -> np.ndarray:
        """Return the cores that have room for a load, ascending."""
        cores = np.flatnonzero((self.amounts + load.amounts <= self._room).all(axis=1))
        for number, most in self.limited.items():
            cores = cores[self.joined_on_all(number, load.profiles[number])[cores] <= most]
        return cores

    def fills(self, load: Load, cores: np.ndarray) -> np.ndarray:
        """Return the share of its scarcest resource that each core would use with a load, (n,)."""
        shares: np.ndarray = ((self.amounts[cores] + load.amounts) / self._room).max(axis=1)
        for number in range(len(PROFILES)):  # see `Capacity.fill`
            joined = self._joined_on(number, load.profiles[number], cores)
            shares = np.maximum(shares, joined / self._most[number])
        return shares

    def added(self, load: Load, cores: np.ndarray) -> np.ndarray:
        """Return how many profiles of all kinds a load would add to each core, (n,)."""
        added = np.zeros(len(cores), dtype=int)
        for number, mask in enumerate(load.profiles):
            masks = self._masks[number]
            added += [(mask & ~masks[core]).bit_count() for core in cores.tolist()]
        return added

    def _joined_on(self, number: int, mask: int, cores: np.ndarray) -> np.ndarray:
        if number in self.limited:
            joined: np.ndarray = self.joined_on_all(number, mask)[cores]
            return joined
        masks = self._masks[number]
        return np.array([(masks[core] | mask).bit_count() for core in cores.tolist()])

    @property
    def amounts(self) -> np.ndarray:
        """The amounts on each core, (n_cores, n_amounts)."""
        return self._amounts[: self._n_cores]

    def joined_on_all(self, number: int, mask: int) -> np.ndarray:
        """Return how many profiles of a limited kind each core would have with those of a mask."""
        return self._kinds[number].joined(mask)


class _Kind:
    """The profiles of one kind on each core: their number, and the cores that have each profile."""

    def __init__(self) -> None:
        self._masks: list[int] = []
        self._count = np.zeros(0, dtype=int)
        self._has: dict[int, np.ndarray] = {}

    def put(self, core: int, mask: int) -> None:
        """Set the profiles of a core; the core after the last is new."""
        if core == len(self._masks):
            self._masks.append(0)
            self._count = _grown(self._count, core + 1)
        before, self._masks[core] = self._masks[core], mask
        # Most blocks bring no profile that is new to their core.
        if before == mask:
            return
        self._count[core] = mask.bit_count()
        for bit in _bits(before ^ mask):
            self._has[bit] = _grown(self._has.get(bit, np.zeros(0, dtype=bool)), core + 1)
            self._has[bit][core] = mask >> bit & 1

    def joined(self, mask: int) -> np.ndarray:
        """Return how many profiles each core would have with those of a mask, (n_cores,)."""
        # Counts of both, less the profiles that they have in common.
        joined: np.ndarray = self._count[: len(self._masks)] + mask.bit_count()
        for bit in _bits(mask):
            if (has := self._has.get(bit)) is not None:
                # The array may be shorter than the list of cores, if no later core has the profile,
                # or longer.
                known = min(len(has), len(joined))
                joined[:known] -= has[:known]
        return joined


def _bits(mask: int) -> list[int]:
    """Return the numbers of the bits that are set, ascending."""
    bits = []
    while mask:
        # The lowest bit that is set.
        low = mask & -mask
        bits.append(low.bit_length() - 1)
        mask ^= low
    return bits


def _grown(array: np.ndarray, n: int) -> np.ndarray:
    """Return an array of at least n rows; if it has to grow, it is at least doubled, with zeros."""
    if len(array) >= n:
        return array
    # Doubled, so that n cores cost a number of copies that grows with log n.
    more = np.zeros((max(n, 2 * len(array)) - len(array), *array.shape[1:]), array.dtype)
    return np.concatenate([array, more])
