"""Functions around the layers of a perceptron, value by value, which the host computes.

Trainers bound values at both ends: rl_games clips the normalised observation to -5 .. 5, and soft
actor-critic sends the action through tanh.
"""

from dataclasses import dataclass
from functools import reduce

import numpy as np

from spikeport.arrays import Floats
from spikeport.reading.mismatch import MismatchError


@dataclass(frozen=True, eq=False)
class Clip:
    """Limits of values, each (n,) or one for all, (): ``min(max(x, low), high)``, low <= high."""

    low: Floats
    high: Floats

    def __call__(self, values: Floats) -> Floats:
        """Return the values within the limits."""
        return np.minimum(np.maximum(values, self.low), self.high)

    def scaled(self, factor: Floats) -> "Clip":
        """Return the limits of ``factor x``."""
        # A factor of 0 makes 0 of any value, whether it has limits or not.
        ends = [np.where(factor == 0, 0.0, factor * end) for end in (self.low, self.high)]
        return Clip(np.minimum(*ends), np.maximum(*ends))

    def shifted(self, offset: Floats) -> "Clip":
        """Return the limits of ``x + offset``."""
        return Clip(self.low + offset, self.high + offset)

    def before(self, factor: Floats, offset: Floats) -> "Clip":
        """Return the limits of x that keep ``factor x + offset`` within these limits."""
        room = self.shifted(-offset)
        of_input = room.scaled(1 / factor)
        # Where the factor hides x, no limit of x is needed if the offset is within these.
        free = (factor == 0) & (room.low <= 0) & (room.high >= 0)
        low, high = np.where(free, -np.inf, of_input.low), np.where(free, np.inf, of_input.high)
        return Clip(low, high)

    def then(self, later: "Clip") -> "Clip":
        """Return the clip that is the same as this one and a later one."""
        return Clip(later(self.low), later(self.high))

    def check(self, size: int) -> None:
        """Raise MismatchError if these cannot be the limits of ``size`` numbers."""
        _check_size(size, self.low, self.high)
        if not ((self.low < np.inf).all() and (self.high > -np.inf).all()):
            raise MismatchError("limits of a clip that are numbers", "NaN or infinity")


@dataclass(frozen=True, eq=False)
class Squash:
    """The function behind the last layer: ``clip(offset + factor f(y))``, f is tanh or nothing.

    Attributes
    ----------
    tanh : bool
        True if f is tanh, False if it passes y on.
    factor, offset : array
        Numbers for each action, (n,), or one for all, ().
    clip : Clip, optional
        The limits of the action.
    """

    tanh: bool
    factor: Floats
    offset: Floats
    clip: Clip | None

    def __call__(self, values: Floats) -> Floats:
        """Return the action for values of the last layer."""
        scaled = self.offset + self.factor * (np.tanh(values) if self.tanh else values)
        return scaled if self.clip is None else self.clip(scaled)

    def check(self, size: int) -> None:
        """Raise MismatchError if this cannot be a function of ``size`` numbers."""
        _check_size(size, self.factor, self.offset)
        if not (np.isfinite(self.factor).all() and np.isfinite(self.offset).all()):
            raise MismatchError("finite numbers", "NaN or infinity behind the last layer")
        if self.clip is not None:
            self.clip.check(size)

    @property
    def words(self) -> str:
        """Its name for a user."""
        return " and ".join(["tanh"] * self.tanh + ["clip"] * (self.clip is not None))


def both(*clips: Clip | None) -> Clip | None:
    """Return the clip that is the same as several, one after the other; None for none."""
    some = [clip for clip in clips if clip is not None]
    return reduce(Clip.then, some) if some else None


def _check_size(size: int, *arrays: Floats) -> None:
    for array in arrays:
        if array.shape not in ((), (1,), (size,)):
            found = f"an array of shape {array.shape}"
            raise MismatchError(f"operations around the layers on {size} values", found)
