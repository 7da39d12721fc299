"""Rehearsals by the exact law; `test_port` and `test_reach` have the regions of tasks."""

from functools import partial

import numpy as np

from spikeport.experiments.arm.reach_task import BOXES, ReachTask
from spikeport.experiments.arm.region import Rehearsal, exact_runs


def rehearsal(seed, seconds):
    return Rehearsal(partial(ReachTask, BOXES["small"], seed), seconds, seed)


def test_a_rehearsal_is_the_same_alone_and_beside_longer_and_shorter_ones(law):
    """The law of several robots at once rounds as that of each of them."""
    whole = [rehearsal(0, 0.5), rehearsal(1, 0.2), rehearsal(2, 0.3)]
    together = exact_runs(law, whole)
    assert [len(run.q) for run in together] == [100, 40, 60]
    for run, one in zip(together, whole, strict=True):
        (alone,) = exact_runs(law, [one])
        for series in ("q", "dq", "hand", "target", "torque"):
            np.testing.assert_array_equal(getattr(run, series), getattr(alone, series))
