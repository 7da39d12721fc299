"""The steps that a probe records."""

import numpy as np


def sampled(n_steps: int, sample_every: float | None, dt_s: float) -> np.ndarray:
    """Return the numbers, from 1, of the steps that are sampled, as Nengo counts them.

    Step n is sampled if n mod (sample_every / dt) < 1; every step where ``sample_every`` is None.
    """
    steps = np.arange(1, n_steps + 1)
    return steps if sample_every is None else steps[steps % (sample_every / dt_s) < 1]
