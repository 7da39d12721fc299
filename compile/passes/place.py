"""`Place`: cores onto the tiles and chips of a board."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.traffic import core_messages
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.hardware_models.limits import n_cores
from spikeport.hardware_models.links import Cost, Links

BUSIEST = 16
"""The number of cores, by messages, that are swapped to relieve links."""


@dataclass(frozen=True)
class Place(ImagePass):
    """Give cores their numbers, and thereby tiles and chips, such that messages have short ways.

    Messages between chips count first, then the fullest link, as a step ends when the last message
    has arrived; hops, which take energy, count third. What a core itself does depends on its blocks
    alone. All neurons are taken to spike alike.
    """

    name: ClassVar[str] = "place"

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Number the cores of an image anew."""
        if image.n_cores > n_cores(context.chip):
            return image  # there is no place for all of it: verification says so
        board = _Board(core_messages(image), Links(image.n_cores, context.chip))
        as_packed = np.arange(image.n_cores)
        found = [board.improved(start) for start in (as_packed, board.clustered())]
        before, after = board.cost(as_packed), min(map(board.cost, found))
        for name in Cost._fields:
            context.note(name, {"before": getattr(before, name), "after": getattr(after, name)})
        place = np.argsort(min(found, key=board.cost))
        return image.on_cores(place[image.blocks.core])


class _Board:
    """Messages between cores, and the places there are. An order holds the core of each place."""

    def __init__(self, messages: np.ndarray, links: Links) -> None:
        self._links, self._distance = links, links.distances()
        self._source, self._target = np.nonzero(messages)
        self._messages = messages[self._source, self._target]
        self._flow = messages + messages.T
        np.fill_diagonal(self._flow, 0)

    def cost(self, order: np.ndarray) -> Cost:
        """Return the cost of the messages."""
        place = np.argsort(order)
        return self._links.cost(place[self._source], place[self._target], self._messages)

    def clustered(self) -> np.ndarray:
        """Lay core after core: each time the one with most messages to those on its tile already.

        Among equals comes the core with most messages to any core laid, then to any at all.
        """
        order: list[int] = []
        left = list(range(len(self._flow)))
        for distance in self._distance:
            near = [core for core, far in zip(order, distance, strict=False) if far == 0]
            wish = [self._flow[left][:, cores].sum(axis=1) for cores in (near, order, slice(None))]
            order.append(left.pop(np.lexsort([np.negative(left), *reversed(wish)])[-1]))
        return np.array(order)

    def improved(self, start: np.ndarray) -> np.ndarray:
        """Swap cores while it helps: first as saves most hops, then as relieves links."""
        order = self._shortened(start)
        while self.cost(relieved := self._relieved(order)) < self.cost(order):
            order = relieved
        return order

    def _shortened(self, order: np.ndarray) -> np.ndarray:
        """Swap the two cores that saves most hops, until none does.

        Moving the core of place i to place j costs a_ij = sum_k f_ik d_jk for messages f between
        cores and distances d of places; a swap saves a_ii + a_jj - a_ij - a_ji - 2 f_ij d_ij.
        """
        order = order.copy()
        while True:
            flow = self._flow[np.ix_(order, order)]
            moved = flow @ self._distance
            own = np.diag(moved)
            saved = own[:, np.newaxis] + own - moved - moved.T - 2 * flow * self._distance
            i, j = np.unravel_index(saved.argmax(), saved.shape)
            if saved[i, j] <= 0:
                return order
            order[[i, j]] = order[[j, i]]

    def _relieved(self, order: np.ndarray) -> np.ndarray:
        """Swap each of the busiest cores with every other where that lowers the cost."""
        order, best = order.copy(), self.cost(order)
        for core in np.argsort(-self._flow.sum(axis=1), kind="stable")[:BUSIEST]:
            for place in range(len(order)):
                here = int(np.flatnonzero(order == core)[0])
                swapped = order.copy()
                swapped[[here, place]] = order[[place, here]]
                if self._distance[here, place] and self.cost(swapped) < best:
                    order, best = swapped, self.cost(swapped)
        return order
