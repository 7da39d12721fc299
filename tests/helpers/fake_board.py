"""A board in the same process, and a clock that advances only by waiting."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from spikeport.backends.board.board import Board, CountingChip, Machine
from spikeport.backends.board.faults import FAULTS, FaultyLine
from spikeport.backends.board.frame import Frame, Splitter
from spikeport.backends.native.chip import NativeChip
from spikeport.compile.image.chip_image import ChipImage
from spikeport.errors import BoardLostError
from tests.helpers.images import Block, Group, Output, Parts, Route

TRIP_S = 50e-6
"""Time from a frame to its answer."""


def native(image: ChipImage, seed: int) -> CountingChip:
    """Load an image on compiled kernels."""
    return NativeChip(image, seed)


MACHINE = Machine("native", native)


def small_image() -> ChipImage:
    """Return 5 sources, two cores, three neurons that spike at different rates, and 3 outputs."""
    return Parts(
        blocks=[
            Block(n=3, bias=[40, 90, 300], vth=1000, decay_v=100),
            Block(n=2, core=1, bias=7, vth=5000, vmin=0, decay_v=50),
        ],
        groups=[
            Group(weights=[[64, -64, 128]] * 5),
            Group(weights=[[64, 128]] * 3, block=1),
        ],
        inputs=[5],
        routes=[Route(axon=[0, 1, 2, 3, 4], input=0), Route(axon=[0, 1, 2], group=1, block=0)],
        outputs=[
            Output("voltage", [3, 4]),
            Output("spiked", [0, 1, 2]),
            Output("current", [3]),
        ],
    ).image()


def spike_train(n: int, seed: int = 0) -> list[np.ndarray]:
    """Return the sources of `small_image` that spike in each of n steps."""
    rng = np.random.RandomState(seed)
    return [np.flatnonzero(rng.uniform(size=5) < 0.4) for _ in range(n)]


class FakeClock:
    """A clock that stands still until somebody waits."""

    def __init__(self) -> None:
        self.time_s = 100.0

    def now(self) -> float:
        """Return the time, in s."""
        return self.time_s

    def sleep_until(self, time_s: float) -> None:
        """Pass to a time."""
        self.time_s = max(self.time_s, time_s)


class FakeLine:
    """A host's line to a board of this process; answers arrive `TRIP_S` later."""

    def __init__(
        self, board: Board, clock: FakeClock, faults: Sequence[str] = (), seed: int = 0
    ) -> None:
        self._board, self._clock = board, clock
        self._board_clock = FakeClock()
        plan = [FAULTS.parse(text) for text in faults]
        self._back = FaultyLine(self, plan, self._board_clock, board.end, seed)
        self._arriving: deque[tuple[float, bytes]] = deque()
        self._splitter = Splitter()
        self.hung_up = self.closed = False

    @property
    def bad(self) -> int:
        """The number of times that bytes were skipped, because they were not a frame."""
        return self._splitter.bad

    def send(self, frame: Frame) -> None:
        """Send a frame of the host to the board, which answers at once."""
        if self.hung_up:
            raise BoardLostError("the board: the link is gone (it hung up)")
        self._board_clock.sleep_until(self._clock.now() + TRIP_S)
        try:
            for answer in self._board.answer(frame):
                self._back.send(answer)
        except BoardLostError:
            self.hung_up = True

    def send_bytes(self, data: bytes) -> None:
        """Let bytes of the board arrive."""
        self._arriving.append((self._board_clock.now(), bytes(data)))

    def receive(self, within_s: float) -> Frame | None:
        """Return the next frame, or None if none comes in time."""
        end = self._clock.now() + within_s
        while (frame := self._splitter.next()) is None:
            if not self._arriving and self.hung_up:
                raise BoardLostError("the board: the link is gone (it hung up)")
            if not self._arriving or self._arriving[0][0] > end:
                self._clock.sleep_until(end)
                return None
            time_s, data = self._arriving.popleft()
            self._clock.sleep_until(time_s)
            self._splitter.feed(data)
        return frame

    def close(self) -> None:
        """Hang up."""
        self.closed = True
