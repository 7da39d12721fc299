"""`Place`: cores are put on the tiles and chips of a board."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.image.traffic import core_messages
from spikeport.compile.passes.base import Context, ImagePass
from spikeport.compile.placing.relief import Messages, Relief
from spikeport.compile.placing.savings import Savings
from spikeport.hardware_models.links import Cost, Links


@dataclass(frozen=True)
class Place(ImagePass):
    """Number the cores, which sets their tiles and chips, so that messages have short paths.

    Messages between chips count first, then the fullest link, as a step ends when the last message
    has arrived; hops, which take energy, count third. A core's own work does not depend on its
    number. Neurons are assumed to spike equally often.
    """

    name: ClassVar[str] = "place"

    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Renumber the cores of an image."""
        if image.n_cores > context.chip.n_cores:
            return image  # there are too few cores: verification reports it
        board = _Board(core_messages(image), Links(image.n_cores, context.chip))
        as_packed = np.arange(image.n_cores)
        # Start twice: swapping stops at a local optimum. The order as packed competes, too: swaps
        # that save hops may fill a link, and swaps that relieve it again may not be found.
        found = [*map(board.improved, (as_packed, board.clustered())), as_packed]
        before, after = board.cost(as_packed), min(map(board.cost, found))
        for name, *change in zip(Cost._fields, before, after, strict=True):
            context.note_change(name, *change)
        place = np.argsort(min(found, key=board.cost))
        return image.on_cores(place[image.blocks.core])


class _Board:
    """The messages between cores, and the places. An order holds the core at each place."""

    def __init__(self, messages: np.ndarray, links: Links) -> None:
        self._links, self._distance = links, links.distances()
        source, target = np.nonzero(messages)
        self._messages = Messages(source, target, messages[source, target])
        self._relief = Relief(self._messages, links, len(messages))
        self._flow = messages + messages.T
        # A message from a core to itself takes no link.
        np.fill_diagonal(self._flow, 0)

    def cost(self, order: np.ndarray) -> Cost:
        """Return the cost of the messages."""
        place = np.argsort(order)
        source, target, number = self._messages
        return self._links.cost(place[source], place[target], number)

    def clustered(self) -> np.ndarray:
        """Place core after core: each time the core with most messages to cores on its tile.

        Ties go to the core with most messages to all placed cores, then to all cores.
        """
        order: list[int] = []
        left = np.arange(len(self._flow))
        to_laid, to_any = np.zeros_like(left), self._flow.sum(axis=1)
        for distance in self._distance:
            tile = [core for core, far in zip(order, distance, strict=False) if far == 0]
            best = left
            for wish in (self._flow[:, tile].sum(axis=1), to_laid, to_any):
                best = best[wish[best] == wish[best].max()]
            order.append(int(best[0]))
            left = left[left != best[0]]
            to_laid = to_laid + self._flow[best[0]]
        return np.array(order)

    def improved(self, start: np.ndarray) -> np.ndarray:
        """Swap cores while this helps: first to save hops, then to relieve links."""
        order = self._shortened(start)
        while self.cost(relieved := self._relief.relieved(order)) < self.cost(order):
            order = relieved
        return order

    def _shortened(self, order: np.ndarray) -> np.ndarray:
        """Swap the two cores that save the most hops, until no swap saves any."""
        savings = Savings(self._flow, self._distance, order)
        while (best := savings.best()) is not None:
            savings.swap(*best)
        return savings.order
