"""Functions of nodes that need no call in every step, with attributes that let backends skip calls.

Nengo takes them for plain functions of nodes, and calls them in every step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

NO_INPUT = np.zeros(0)
"""The values of a node without an input, whose function Nengo calls with the time alone."""


class Held:
    """A node's function that is computed again only if its input has changed.

    Parameters
    ----------
    function : callable
        A function of the input alone; the same input gives the same output.
    """

    def __init__(self, function: Callable[[np.ndarray], np.ndarray]) -> None:
        self._function = function
        self._key: bytes | None = None

    def __call__(self, _t: float, values: np.ndarray) -> np.ndarray:
        """Return the function of the values; ``_t`` is Nengo's time."""
        key = values.tobytes()
        if key != self._key:
            self._key, self._found = key, self._function(values)
        return self._found


class Affine:
    """The function ``offset + factor x`` of a node's input.

    Parameters
    ----------
    factor, offset : float
        The same for every value. By default the input is passed on, bit for bit: -0.0 + 0.0 is 0.0,
        and -0.0 + -0.0 is -0.0.
    """

    def __init__(self, factor: float = 1.0, offset: float = -0.0) -> None:
        self.factor, self.offset = factor, offset

    def __call__(self, _t: float, values: np.ndarray) -> np.ndarray:
        """Return the function of the values; ``_t`` is Nengo's time."""
        return self.offset + self.factor * values


class Skippable(ABC):
    """A node's function that returns the same value for some steps, e.g. of a slower plant.

    Attributes
    ----------
    left : ndarray, (1,), or None
        The steps that are still skipped, which a backend counts down; None if no backend does.
    """

    left: np.ndarray | None = None

    @abstractmethod
    def __call__(self, t: float, values: np.ndarray) -> np.ndarray | None:
        """Return the value of a step; None for a node without output."""

    @abstractmethod
    def skip(self) -> int:
        """Return the number of next steps in which the value stays the same.

        They count as done: the caller holds the value, and calls again in the step after them.
        """

    def end_skip(self) -> None:
        """Ask for a call in the next step, since the value has changed."""
        if self.left is not None:
            self.left[0] = 0
