"""Points that wait for workers, by network: a worker that made a network continues with it."""

from collections import deque
from collections.abc import Iterable

from spikeport.experiments.sweep.plan import Point


class Queue:
    """Points that wait, grouped by network, and in order within each group.

    Parameters
    ----------
    points : iterable of Point
        The points of the sweep.
    """

    def __init__(self, points: Iterable[Point]) -> None:
        self._waiting: dict[str, deque[Point]] = {}
        self._begun: set[str] = set()
        for point in points:
            self.put(point)

    def __bool__(self) -> bool:
        """Return whether a point waits."""
        return bool(self._waiting)

    def put(self, point: Point) -> None:
        """Add a point behind the others of its network."""
        self._waiting.setdefault(point.network, deque()).append(point)

    def take(self, network: str | None) -> Point:
        """Take a point for a worker that has made ``network``, or None.

        The point is of this network if one waits. Else it is the first one of a network that no
        worker has begun, or else of the network with the most points that wait.
        """
        chosen = network if network in self._waiting else self._other()
        self._begun.add(chosen)
        points = self._waiting[chosen]
        point = points.popleft()
        if not points:
            del self._waiting[chosen]
        return point

    def _other(self) -> str:
        # A new network first: a second worker on the same network would compile it once more.
        new = next((network for network in self._waiting if network not in self._begun), None)
        return new or max(self._waiting, key=lambda network: len(self._waiting[network]))
