"""Finds the network a user names: built in, in a file, or in a module."""

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nengo

from spikeport import settings
from spikeport.errors import SpikeportError, UsageError, unknown
from spikeport.experiments.registry import imported

BUILT_IN = {"arm": "spikeport.experiments.arm.reach:arm_network"}
OURS = {spec.partition(":")[0] for spec in BUILT_IN.values()}


def find_network(spec: str, pairs: list[str]) -> nengo.Network:
    """Build the network that ``spec`` names.

    Parameters
    ----------
    spec : str
        A built-in name, ``path/to/file.py:function`` or ``module:function``.
    pairs : list of str
        ``KEY=VALUE`` arguments of the function.

    Raises
    ------
    UsageError
        If it is not found, cannot be imported, raises an error, or does not return a network.
    """
    where, _, name = BUILT_IN.get(spec, spec).rpartition(":")
    if not (where and name):
        raise unknown("network", spec, [*BUILT_IN, "path/to/file.py:function", "module:function"])
    function = _function(where, name)
    arguments = settings.parse(pairs, function, f"network '{spec}'")
    try:
        inspect.signature(function).bind(**arguments)
    except TypeError as error:
        raise UsageError(f"{spec}: {error}; give its arguments with --set KEY=VALUE") from None
    try:
        network = function(**arguments)
    except SpikeportError:
        raise
    except Exception as error:
        raise UsageError(f"{spec}: raised {type(error).__name__}: {error}") from error
    if not isinstance(network, nengo.Network):
        raise UsageError(f"{spec}: returned {type(network).__name__}, expected nengo.Network")
    return network


def _function(where: str, name: str) -> Callable[..., Any]:
    module = _import(where)
    function = getattr(module, name, None)
    if not callable(function):
        known = [n for n, v in vars(module).items() if callable(v) and not n.startswith("_")]
        raise unknown(f"function of {where}", name, known)
    return function


def _import(where: str) -> Any:
    if where in OURS:
        return imported("the network", where)
    return _import_file(Path(where)) if where.endswith(".py") else _import_module(where)


def _import_module(name: str) -> Any:
    sys.path.insert(0, str(Path.cwd()))  # as python -m looks for modules
    try:
        return importlib.import_module(name)
    except SpikeportError:
        raise
    except (Exception, SystemExit) as error:
        raise UsageError(
            f"module '{name}' cannot be imported: {type(error).__name__}: {error}"
        ) from error


def _import_file(path: Path) -> Any:
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
