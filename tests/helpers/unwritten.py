"""Runs whose files no test reads; pictures and time series take a second or two to write."""

import contextlib
from typing import TypeVar

from spikeport.compile.check.lost_values import cut_off_by_design
from spikeport.experiments import driver
from spikeport.experiments.options import Outcome
from spikeport.experiments.trial import Rig, Trial

K = TypeVar("K", bound=Rig)
R = TypeVar("R")


@cut_off_by_design()
def outcome(trial: Trial[K, R]) -> Outcome:
    """Return the outcome of a trial that is run without a folder."""
    ready = driver.prepare(trial)
    with contextlib.closing(ready):
        return driver.outcome(trial, ready, driver.perform(trial, ready), {})
