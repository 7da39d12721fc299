"""The region of states a network is made for.

Ensembles represent values in [-1, 1], and every error after their input is a fixed share of that
range. So the range is as narrow as the task allows: it is taken from recorded states.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from spikeport.arrays import Floats

PEAK_PERCENTILE = 99.5
BOXES = ("q", "dq", "x", "error")
SIDES = ("centre", "half")


@dataclass(frozen=True)
class Box:
    """An axis-aligned box that is mapped onto [-1, 1] in every dimension.

    ``half``, half of each edge, must be above 0 wherever values are normalised: `at_least` widens a
    box of samples that do not vary.
    """

    centre: Floats
    half: Floats

    @classmethod
    def around(cls, samples: Floats, margin: float = 0.1) -> "Box":
        """Return the box of all (n, d) samples, widened by a share of its size."""
        low, high = samples.min(axis=0), samples.max(axis=0)
        return cls((low + high) / 2, (high - low) / 2 * (1 + margin))

    @classmethod
    def symmetric(cls, samples: Floats, margin: float = 0.1) -> "Box":
        """Return a box centred at zero that holds nearly all samples; peaks beyond are clipped."""
        half = np.percentile(np.abs(samples), PEAK_PERCENTILE, axis=0)
        return cls(np.zeros_like(half), half * (1 + margin))

    def holding(self, points: Floats) -> "Box":
        """Return the box, widened where one of the points (n, d) is beyond it."""
        if (np.abs((points - self.centre) / self.half) <= 1).all():
            return self
        low = np.minimum(self.centre - self.half, points.min(axis=0))
        high = np.maximum(self.centre + self.half, points.max(axis=0))
        return Box((low + high) / 2, (high - low) / 2)

    def at_least(self, half: Floats) -> "Box":
        """Return the box, widened where it is narrower than ``half``."""
        return Box(self.centre, np.maximum(self.half, half))

    @classmethod
    def join(cls, *boxes: "Box") -> "Box":
        """Return the box with the dimensions of all boxes, one box after the other."""
        return cls(*(np.concatenate([getattr(b, k) for b in boxes]) for k in ("centre", "half")))

    def normalise(self, values: Floats) -> Floats:
        """Return the values in units of the box, clipped to it."""
        return np.minimum(np.maximum((values - self.centre) / self.half, -1.0), 1.0)

    def clip(self, values: Floats) -> Floats:
        """Return the points of the box that are nearest to the values."""
        return self.restore(self.normalise(values))

    def restore(self, normalised: Floats) -> Floats:
        """Return the inverse of `normalise` inside the box."""
        return self.centre + normalised * self.half


@dataclass(frozen=True)
class ArmRegion:
    """Boxes of joint angles, joint velocities, hand positions and position errors.

    ``q_samples`` (n, 4) are recorded joint angles in radians inside the box, at which decoders are
    solved.
    """

    q: Box
    dq: Box
    x: Box
    error: Box
    q_samples: Floats

    def holding(self, targets: Floats) -> "ArmRegion":
        """Return the region, with boxes of positions and errors for the targets (n, 3) in m, too.

        A hand that lags behind its target cuts corners, so that recordings do not pass through all
        targets, and a target beyond the box would be clipped to it.
        """
        position = self.x.holding(targets)
        return replace(self, x=position, error=self.error.at_least(position.half))

    def arrays(self) -> dict[str, Floats]:
        """Return all its arrays by name, for a cache."""
        sides = {
            f"{box}.{side}": getattr(getattr(self, box), side) for box in BOXES for side in SIDES
        }
        return {**sides, "q_samples": self.q_samples}

    @classmethod
    def of(cls, arrays: Mapping[str, Floats]) -> "ArmRegion":
        """Return the region from its `arrays`; other arrays in the mapping are ignored."""
        boxes = {box: Box(*(arrays[f"{box}.{side}"] for side in SIDES)) for box in BOXES}
        return cls(**boxes, q_samples=arrays["q_samples"])

    @classmethod
    def from_recording(
        cls,
        q: Floats,
        dq: Floats,
        x: Floats,
        error: Floats,
        *,
        seed: int,
        n_samples: int = 10_000,
        jitter: float = 0.1,
    ) -> "ArmRegion":
        """Return the region of states that were recorded while the exact law does the task.

        The samples are drawn from the recording and jittered by a share of each joint's range:
        spiking runs leave the recorded path, and decoders must be accurate beside it, too.

        The box of errors is no narrower than that of positions: target and position reach M1
        separately, in units of the error, and each is clipped beyond 1.
        """
        rng = np.random.RandomState(seed)
        box = Box.around(q)
        drawn = q[rng.randint(len(q), size=n_samples)]
        drawn = drawn + rng.uniform(-jitter, jitter, drawn.shape) * 2 * box.half
        position = Box.around(x)
        errors = Box.symmetric(error).at_least(position.half)
        return cls(box, Box.symmetric(dq), position, errors, box.clip(drawn))
