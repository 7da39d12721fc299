"""Finds the network a user names: built in, in a file, or in a module."""

import functools
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import nengo

from spikeport import key_values
from spikeport.build_timer import OutOfTime, watched
from spikeport.errors import NetworkError, SpikeportError, UsageError, unknown
from spikeport.experiments import registry
from spikeport.experiments.options import Experiment, Options

BUILT_IN = {"arm": "reach", "humanoid": "switch", "walk": "walk"}
"""The built-in networks, each with the experiment that runs it."""

FORMS = ("path/to/file.py:function", "module:function", "graph.nir")
"""Forms of other networks' names."""


def needed_passes(spec: str) -> str | None:
    """The passes that a network is made for, if it says so."""
    return _experiment(spec).pipeline if spec in BUILT_IN else None


def find_network(
    spec: str,
    pairs: list[str],
    chip: str = "loihi",
    passes: str | None = None,
    timeout_s: float | None = None,
) -> nengo.Network:
    """Build the network that ``spec`` names.

    Parameters
    ----------
    spec : str
        A built-in name, ``path/to/file.py:function``, ``module:function`` or ``graph.nir``.
    pairs : list of str
        ``KEY=VALUE`` arguments of the function; of a built-in network, its experiment's settings.
    chip, passes : str
        Chip and passes of its compile, for which read-outs of built-in networks are calibrated.
    timeout_s : float, optional
        Longest time that the user's code may take; by default as long as it likes.

    Raises
    ------
    UsageError
        If it is not found, cannot be imported, or is no function that returns a network.
    NetworkError
        If the function raises an error, exits, or takes too long.
    """
    if spec in BUILT_IN:
        return _built_in(spec, pairs, chip, passes)
    if spec.endswith(".nir"):
        return _graph(spec, pairs)
    with watched(spec, timeout_s):
        return _users(spec, pairs)


def _graph(spec: str, pairs: list[str]) -> nengo.Network:
    """Load a NIR graph; its time step and other arguments are settings."""
    from spikeport import nir

    load = functools.partial(nir.load, spec)
    arguments: dict[str, Any] = dict(key_values.parse(pairs, load, f"NIR graph '{spec}'"))
    if "dt" not in arguments:
        raise UsageError(
            f"{spec}: a NIR graph has no time step; give that of its equations, in seconds, with "
            "--dt, or --set dt=SECONDS"
        )
    return load(**arguments)


def _users(spec: str, pairs: list[str]) -> nengo.Network:
    where, _, name = spec.rpartition(":")
    if not (where and name):
        raise unknown("network", spec, [*BUILT_IN, *FORMS])
    function = _function(where, name)
    arguments = key_values.parse(pairs, function, f"network '{spec}'")
    try:
        inspect.signature(function).bind(**arguments)
    except TypeError as error:
        raise UsageError(f"{spec}: {error}; give its arguments with --set KEY=VALUE") from None
    try:
        network = function(**arguments)
    except (SpikeportError, KeyboardInterrupt, OutOfTime):
        raise
    except BaseException as error:  # a user's code may exit, too, which must not look like success
        raise NetworkError(f"{spec}: raised {type(error).__name__}: {error}") from error
    if not isinstance(network, nengo.Network):
        raise UsageError(f"{spec}: returned {type(network).__name__}, expected nengo.Network")
    return network


def _built_in(spec: str, pairs: list[str], chip: str, passes: str | None) -> nengo.Network:
    experiment = _experiment(spec)
    chosen = experiment.settings(
        **key_values.parse(pairs, experiment.settings, f"network '{spec}'")
    )
    options = Options(experiment.seconds, chip=chip, pipeline=experiment.passes(passes))
    return experiment.trial(chosen, options).network()


def _experiment(spec: str) -> Experiment:
    """The experiment that runs a built-in network."""
    module = registry.imported(f"network '{spec}'", registry.EXPERIMENTS[BUILT_IN[spec]])
    experiment: Experiment = module.EXPERIMENT
    return experiment


def _function(where: str, name: str) -> Callable[..., object]:
    module = _import(where)
    function: object = getattr(module, name, None)
    if not callable(function):
        known = [n for n, v in vars(module).items() if callable(v) and not n.startswith("_")]
        raise unknown(f"function of {where}", name, known)
    return function


def _import(where: str) -> ModuleType:
    return _import_file(Path(where)) if where.endswith(".py") else _import_module(where)


def _import_module(name: str) -> ModuleType:
    sys.path.insert(0, str(Path.cwd()))  # as python -m looks for modules
    try:
        return importlib.import_module(name)
    except SpikeportError:
        raise
    except (Exception, SystemExit) as error:
        raise UsageError(
            f"module '{name}' cannot be imported: {type(error).__name__}: {error}"
        ) from error


def _import_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise UsageError(f"{path}: no such file")
    spec = importlib.util.spec_from_file_location(f"spikeport_network_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent.resolve()))  # as python looks for a script's neighbours
    sys.modules[spec.name] = module  # where dataclasses look for the names in their annotations
    try:
        spec.loader.exec_module(module)
    except SpikeportError:
        raise
    except (Exception, SystemExit) as error:
        raise UsageError(f"{path}: cannot be imported: {type(error).__name__}: {error}") from error
    return module
