"""Random commands of an episode: speeds and yaw rates that policies are trained for."""

import numpy as np

from spikeport.experiments.walk.gait import COMMANDS

HELD_S = (3.0, 8.0)
"""The shortest and the longest time for which a command is held."""
STANDING, TURNING = 0.1, 0.1
"""Shares of commands to stand, and to turn in place."""
_STREAM = 2
"""The number of this random stream, beside the seed of a run."""


class RandomCommands:
    """Commands that jump at random times; a `LegsPort` limits their change as in training.

    Parameters
    ----------
    seconds : float
        The length of an episode.
    seed : int
        Draws times and commands.
    """

    def __init__(self, seconds: float, seed: int) -> None:
        rng = np.random.RandomState([_STREAM, seed])
        starts, drawn = [0.0], [_drawn(rng)]
        while starts[-1] < seconds:
            starts.append(starts[-1] + rng.uniform(*HELD_S))
            drawn.append(_drawn(rng))
        self._starts_s, self._drawn = np.array(starts), np.array(drawn)

    def at(self, time_s: float) -> np.ndarray:
        """Return forward speed in m/s and yaw rate in rad/s, (2,)."""
        command: np.ndarray = self._drawn[self._number(time_s)]
        return command

    def age_s(self, time_s: np.ndarray) -> np.ndarray:
        """Return the time in s for which the commands at times (n,) have been held."""
        return np.asarray(time_s - self._starts_s[self._number(time_s)])

    def _number(self, time_s: float | np.ndarray) -> np.ndarray:
        # A command holds from its start on, that moment included.
        return np.asarray(self._starts_s.searchsorted(time_s, side="right") - 1)


def _drawn(rng: np.random.RandomState) -> list[float]:
    # Drawn in any case, so that every command takes three numbers of the stream.
    kind = rng.uniform()
    speed, yaw_rate = (rng.uniform(*reach) for reach in COMMANDS)
    if kind < STANDING:
        return [0.0, 0.0]
    return [0.0 if kind > 1 - TURNING else speed, yaw_rate]
