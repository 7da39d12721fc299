"""The experiments there are."""

from spikeport.errors import unknown
from spikeport.experiments import reach
from spikeport.experiments.options import Experiment

EXPERIMENTS = {e.name: e for e in (reach.EXPERIMENT,)}


def get(name: str) -> Experiment:
    """The experiment of that name.

    Raises
    ------
    UsageError
        If there is none; lists those there are.
    """
    if name not in EXPERIMENTS:
        raise unknown("experiment", name, EXPERIMENTS)
    return EXPERIMENTS[name]
