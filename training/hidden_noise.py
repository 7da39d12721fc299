"""The noise of spikes on a policy's hidden units: a stand-in for the network it is converted to.

    h += (1 + |h|) (w + l)    w ~ N(0, white²) at every step, l ~ N(0, lasting²) in every episode

Spikes are noise that differs from step to step. A unit's decoders also have an error that recurs in
every step, which a mean over time does not remove.
"""

from dataclasses import dataclass

import torch


@dataclass(frozen=True)
class HiddenNoise:
    """Standard deviations of the two parts."""

    white: float = 0.0
    lasting: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.white or self.lasting)


class HiddenNoiseSource:
    """Noise ``w + l`` of n robots with ``units`` hidden units each.

    Parameters
    ----------
    noise : HiddenNoise
        The size of the noise.
    robots, units : int
        Number of robots, and of hidden units.
    """

    def __init__(self, noise: HiddenNoise, robots: int, units: int) -> None:
        self._noise = noise
        self._lasting = torch.zeros(robots, units)
        self._redraw(torch.ones(robots, dtype=torch.bool))

    def draw(self, starts: torch.Tensor) -> torch.Tensor:
        """Return the noise of a step, ``(n, units)``; ``starts (n,)`` marks new episodes."""
        self._redraw(starts)
        return torch.empty_like(self._lasting).normal_(std=self._noise.white) + self._lasting

    def _redraw(self, which: torch.Tensor) -> None:
        if self._noise.lasting and which.any():
            size = (int(which.sum()), self._lasting.shape[1])
            self._lasting[which] = torch.empty(size).normal_(std=self._noise.lasting)
