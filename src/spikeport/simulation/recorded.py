"""The recording of a probe in two runs, and their difference."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spikeport.backends.rerun import low_pass

LATEST_S = 0.05
"""The longest delay of a chip that is looked for."""
MOST_VALUES = 10**7
"""Values of a recording in which a delay is looked for, which takes a second."""


@dataclass(frozen=True)
class Recorded:
    """The recording of a probe: times (n,) in s, and values (n, size) on the backend and in float.

    ``values_float`` is None where there was no run in float Nengo, or its values have other units
    than the chip's; ``spikes`` says that the values are spikes, as they are.
    """

    times_s: np.ndarray
    values: np.ndarray
    values_float: np.ndarray | None
    spikes: bool

    def error(self) -> float | None:
        """Return the error of the run on the backend.

            error = rms(values - values_float) / rms(values_float)

        Both are low-pass filtered with 20 ms before. None where there is no float run, nothing was
        recorded, or its values are zero throughout.
        """
        return None if self._filtered is None else _apart(*self._filtered)

    def rms_float(self) -> float | None:
        """Return the rms of the filtered values in float, None where there is no error.

        It is the scale of the error: one of values near zero is mostly their noise.
        """
        if self._filtered is None:
            return None
        exact = self._filtered[1]
        return float(np.linalg.norm(exact) / np.sqrt(exact.size))

    def delayed(self) -> tuple[float, float] | None:
        """Return the delay in s, up to 50 ms, at which the error is least, and that error.

        A chip computes later than float Nengo: values take steps from host to chip and back, and
        decode neurons have a filter of their own. None where there is no error, where it is least
        without a delay, and for recordings of more than 10^7 values.
        """
        if self._filtered is None or self.values.size > MOST_VALUES:
            return None
        ours, exact = self._filtered
        # No more than half a recording is cut off: what is left has to show the signal.
        shifts = range(min(round(LATEST_S / self._every_s) + 1, len(ours) // 2))
        errors = [_apart(ours[k:], exact[: len(exact) - k]) for k in shifts]
        best = int(np.argmin(errors))
        return (best * self._every_s, errors[best]) if best else None

    @property
    def _every_s(self) -> float:
        """The mean time between two samples: they are uneven where it is no multiple of dt."""
        return float((self.times_s[-1] - self.times_s[0]) / (len(self.times_s) - 1))

    @cached_property
    def _filtered(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The values of both runs, filtered; None where there are none to compare."""
        if self.values_float is None or len(self.times_s) < 2 or not self.values_float.any():
            return None
        pair = (self.values, self.values_float)
        ours, exact = (low_pass(x.astype(float), self._every_s) for x in pair)
        return ours, exact


def _apart(ours: np.ndarray, exact: np.ndarray) -> float:
    """Return the relative rms difference; infinite of zeros."""
    norm = np.linalg.norm(exact)
    return float(np.linalg.norm(ours - exact) / norm) if norm > 0 else np.inf
