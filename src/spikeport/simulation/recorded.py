"""The recording of a probe in two runs, and their difference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spikeport.backends.rerun import low_pass

LATEST_S = 0.05
"""The longest delay of a chip that is looked for."""
MOST_VALUES = 10**7
"""Most values of a recording in which a delay is looked for, which takes a second."""


@dataclass(frozen=True)
class Recorded:
    """The recording of a probe: times (n,) in s, and values (n, size) on the backend and in float.

    ``values_float`` is None if there was no run in float Nengo, or if its values have other units
    than the chip's; ``spikes`` is True if the values are unfiltered spikes.
    """

    times_s: np.ndarray
    values: np.ndarray
    values_float: np.ndarray | None
    spikes: bool

    def error(self) -> float | None:
        """Return the error of the run on the backend.

            error = rms(values - values_float) / rms(values_float)

        Both are low-pass filtered with 20 ms first. None if there is no float run, if fewer than
        two samples were recorded, or if the float values are all zero.
        """
        return None if self._filtered is None else _apart(*self._filtered)

    def rms_float(self) -> float | None:
        """Return the rms of the filtered values in float; None if there is no error.

        It is the scale of the error: the error of values near zero is mostly noise.
        """
        if self._filtered is None:
            return None
        exact = self._filtered[1]
        return float(np.linalg.norm(exact) / np.sqrt(exact.size))

    def best_delay(self) -> tuple[float, float] | None:
        """Return the delay in s, up to 50 ms, at which the error is least, and that error.

        A chip computes later than float Nengo: values take steps from host to chip and back, and
        decode neurons have a filter of their own. None if there is no error, if it is least without
        a delay or still falls at the longest, and for recordings of more than 10^7 values.
        """
        if self._filtered is None or self.values.size > MOST_VALUES:
            return None
        ours, exact = self._filtered
        # At most half a recording is cut off: the rest has to show the signal.
        shifts = range(min(round(LATEST_S / self._every_s) + 1, len(ours) // 2))
        errors = [_apart(ours[k:], exact[: len(exact) - k]) for k in shifts]
        best = int(np.argmin(errors))
        return (best * self._every_s, errors[best]) if 0 < best < len(errors) - 1 else None

    @property
    def _every_s(self) -> float:
        """The mean time between two samples, which are uneven if it is not a multiple of dt."""
        return float((self.times_s[-1] - self.times_s[0]) / (len(self.times_s) - 1))

    @cached_property
    def _filtered(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The values of both runs, filtered; None if there is nothing to compare."""
        if self.values_float is None or len(self.times_s) < 2 or not self.values_float.any():
            return None
        pair = (self.values, self.values_float)
        ours, exact = (low_pass(x.astype(float), self._every_s) for x in pair)
        return ours, exact


def _apart(ours: np.ndarray, exact: np.ndarray) -> float:
    """Return the rms difference relative to ``exact``; infinite if that is zero."""
    norm = np.linalg.norm(exact)
    return float(np.linalg.norm(ours - exact) / norm) if norm > 0 else np.inf
