"""What the arm can be told to do, and runs of the exact law that rehearse it."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

SHOULDER_M = (0.0, -0.2135, 1.4989)
"""The right shoulder with the pelvis anchored at 1.06 m: centre of the reachable shell."""


class Task(Protocol):
    """Something that tells the arm where to go."""

    target: np.ndarray

    def update(self, time_s: float, hand: np.ndarray) -> None:
        """Look at the hand's position, and move on if it is time to."""


class Rehearsal(NamedTuple):
    """A run of the exact law that shows which states a task needs.

    ``task`` makes it from the hand's position (3,) at the start; ``seed`` draws the posture there.
    """

    task: Callable[[np.ndarray], Task]
    seconds: float
    seed: int
