"""The experiments by name; each is imported on demand, since most need the robot's packages."""

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
        If there is none; the error lists the names.
    MissingExtraError
        If a package it needs is absent; the error names the extra that installs it.
    """
    if name.endswith((".py", ".ipynb")) or ":" in name:
        raise UsageError(
            f"{name}: not an experiment; to run a network, use: spikeport simulate {name}"
        )
    if name not in EXPERIMENTS:
        raise unknown("experiment", name, EXPERIMENTS)
    experiment: Experiment = imported(f"experiment '{name}'", EXPERIMENTS[name]).EXPERIMENT
    return experiment


def imported(what: str, module: str, extra: str = "robot") -> ModuleType:
    """Import a module that ``what`` needs, and whose packages an extra installs.

    Raises
    ------
    MissingExtraError
        If a package is absent; the error names the extra that installs it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise missing(what, error.name, extra) from error
