"""The experiments there are; each is imported when it is asked for, since most need the robot."""

from importlib import import_module
from types import ModuleType

from spikeport.errors import UsageError, unknown
from spikeport.experiments.options import Experiment
from spikeport.extras import missing

EXPERIMENTS = {
    "draw": "spikeport.experiments.arm.draw",
    "reach": "spikeport.experiments.arm.reach",
    "switch": "spikeport.experiments.switch.trial",
    "walk": "spikeport.experiments.walk.trial",
}
"""The module of each experiment, which names it ``EXPERIMENT``."""


def get(name: str) -> Experiment:
    """Return the experiment of that name.

    Raises
    ------
    UsageError
        If there is none; lists those there are.
    MissingExtraError
        If a package it needs is absent; names the extra that brings it.
    """
    if name.endswith((".py", ".ipynb")) or ":" in name:
        raise UsageError(f"{name}: no experiment; a network is run by: spikeport simulate {name}")
    if name not in EXPERIMENTS:
        raise unknown("experiment", name, EXPERIMENTS)
    experiment: Experiment = imported(f"experiment '{name}'", EXPERIMENTS[name]).EXPERIMENT
    return experiment


def imported(what: str, module: str, extra: str = "robot") -> ModuleType:
    """Import a module which ``what`` needs, and whose packages an extra brings.

    Raises
    ------
    MissingExtraError
        If a package is absent; names the extra that brings it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise missing(what, error.name, extra) from error
