"""The steps that a probe samples, and the values that it recorded."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import nengo


def sampled(n_steps: int, sample_every: float | None, dt_s: float) -> np.ndarray:
    """Return the numbers, from 1, of the steps that are sampled; see `is_sampled`."""
    steps = np.arange(1, n_steps + 1)
    return steps if sample_every is None else steps[steps % (sample_every / dt_s) < 1]


def is_sampled(step: int, sample_every: float | None, dt_s: float) -> bool:
    """Return whether a step, counted from 1, is sampled, as Nengo counts them.

    Step n is sampled if n mod (sample_every / dt) < 1; every step where ``sample_every`` is None.
    """
    return sample_every is None or step % (sample_every / dt_s) < 1


def recorded(simulator: "nengo.Simulator", probe: "nengo.Probe") -> np.ndarray:
    """Return the values that a probe recorded, (n, ...)."""
    # Without samples, Nengo's array lacks the shape of the probe.
    found = np.asarray(simulator.data[probe])
    return found if len(found) else np.zeros((0, *simulator.model.sig[probe]["in"].shape))
