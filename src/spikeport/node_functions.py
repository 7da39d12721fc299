"""Functions of nodes that need no call in every step, and what a backend reads to leave calls out.

Each is a plain function of a node to Nengo, which calls it in every step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

NO_INPUT = np.zeros(0)
"""The values of a node without an input, whose function Nengo calls with the time alone."""


class Held:
    """A node's function that is computed anew only where its input has changed.

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
        The same for every value; by default the input is passed on, bit for bit: the sum of -0.0
        and 0.0 is 0.0, that of -0.0 and -0.0 is -0.0.
    """

    def __init__(self, factor: float = 1.0, offset: float = -0.0) -> None:
        self.factor, self.offset = factor, offset

    def __call__(self, _t: float, values: np.ndarray) -> np.ndarray:
        """Return the function of the values; ``_t`` is Nengo's time."""
        return self.offset + self.factor * values


class Skippable(ABC):
    """A node's function that returns the same value for some steps, as a plant that is slower.

    Attributes
    ----------
    left : ndarray, (1,), or None
        The steps that are still skipped, which a backend counts down; None where none does.
    """

    left: np.ndarray | None = None

    @abstractmethod
    def __call__(self, t: float, values: np.ndarray) -> np.ndarray | None:
        """Return the value of a step; None for a node without output."""

    @abstractmethod
    def skip(self) -> int:
        """Return for how many of the next steps the value stays.

        They count as made: whoever asks holds the value, and calls again in the step behind them.
        """

    def end_skip(self) -> None:
        """Be called in the next step, since the value is another one now."""
        if self.left is not None:
            self.left[0] = 0
