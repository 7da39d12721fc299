"""The search for the network a user names: built in, or in a file, a notebook or a module."""

import functools
import inspect
import os
from collections.abc import Callable
from types import ModuleType
from typing import Any

import nengo

from spikeport import cache, key_values, user_code
from spikeport.build_timer import FROM_OUTSIDE, watched
from spikeport.candidates import makers_in, networks_in
from spikeport.errors import NetworkError, SpikeportError, UsageError, in_words, unknown
from spikeport.experiments import registry
from spikeport.experiments.options import Experiment, Options

BUILT_IN = {"arm": "reach", "humanoid": "switch", "walk": "walk"}
"""The built-in networks, each with the experiment that runs it."""
USUAL = ("model", "net")
"""Names that Nengo's documentation and GUI give to the network of a script."""
NIR = ".nir"
"""How the name of a NIR graph's file ends."""
FORMS = ("FILE.py", "FILE.ipynb", "FILE.py:NAME", "module:NAME", "graph.nir")
"""Forms of the names of networks that are not built in."""


def parts(spec: str) -> tuple[str, str]:
    """Return the file or the module that ``spec`` names, and the name in it; empty if absent."""
    if spec.endswith((*user_code.FILES, NIR)):
        return spec, ""
    where, _, name = spec.rpartition(":")
    return where, name


def needed_passes(spec: str) -> str | None:
    """Return the passes that a network is made for, if it is built in and names any."""
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
        A built-in name; ``FILE.py:NAME``, ``FILE.ipynb:NAME`` or ``module:NAME``, with the name of
        a network, or of a function or class that makes one; a file alone, for its network called
        ``model`` or ``net``, or its only network, or its only function or class that makes one
        (networks within others do not count); or ``graph.nir``.
    pairs : list of str
        ``KEY=VALUE`` arguments of the function; of a built-in network, its experiment's settings.
    chip, passes : str
        Chip and passes of its compile, for which read-outs of built-in networks are calibrated.
    timeout_s : float, optional
        Longest time that building may take; by default there is no limit.

    Raises
    ------
    UsageError
        If it is not found, cannot be imported, or is not a function that returns a network.
    NetworkError
        If the function raises an error, exits, or takes too long.
    """
    with watched(spec, timeout_s):
        if spec in BUILT_IN:
            return built_in(spec, pairs, chip, passes)
        if spec.endswith(NIR):
            return _graph(spec, pairs)
        from spikeport.compile.loihi.numpy1 import numpy1_semantics_without_turns

        # Scripts for nengo-loihi often end with a run on its simulator, which fails under NumPy 2.
        with numpy1_semantics_without_turns():
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
    where, name = parts(spec)
    if not where or (where != spec and not name):
        raise unknown("network", spec, [*BUILT_IN, *FORMS])
    # A module may be called nir, too.
    if where.endswith(NIR) and os.path.exists(where):
        raise UsageError(f"{spec}: a NIR graph is one network, without names; cure: give {where}")
    with user_code.without_arguments(where):
        module = user_code.imported(where)
        found = _named(module, where, name) if name else _only(module, where)
        if not isinstance(found, nengo.Network):
            return _made(found, spec, pairs)
    if pairs:
        raise UsageError(f"--set {pairs[0]}: {spec} is a network, not a function: it takes none")
    return found


def _named(module: ModuleType, where: str, name: str) -> nengo.Network | Callable[..., object]:
    found: object = getattr(module, name, None)
    if isinstance(found, nengo.Network) or callable(found):
        return found
    known = [*networks_in(module), *makers_in(module)]
    if not known:
        raise UsageError(f"unknown network of {where} '{name}'; there is none in it")
    raise unknown(f"network of {where}", name, known)


def _only(module: ModuleType, where: str) -> nengo.Network | Callable[..., object]:
    """Return the only network of a file, or its only function or class that makes one."""
    networks, makers = _outermost(networks_in(module)), makers_in(module)
    usual = {name: networks[name] for name in USUAL if name in networks}
    # One network may have several names in a script.
    if len(different := {id(one): one for one in (usual or networks).values()}) == 1:
        return next(iter(different.values()))
    if not networks and len(makers) == 1:
        return next(iter(makers.values()))
    if not networks and not makers:
        raise UsageError(
            f"{where}: no network in it: name one `model`, or write a function that returns one"
        )
    forms = ", ".join(f"{where}:{name}" for name in sorted(usual or [*networks, *makers]))
    called = "called model and net" if usual else "none called model or net"
    raise UsageError(f"{where}: several networks in it, {called}; give {forms}")


def _outermost(networks: dict[str, nengo.Network]) -> dict[str, nengo.Network]:
    """Return the networks that are no part of another: a script may name its subnetworks, too."""
    parts = {id(part) for one in networks.values() for part in one.all_networks}
    return {name: one for name, one in networks.items() if id(one) not in parts}


def _made(make: Callable[..., object], spec: str, pairs: list[str]) -> nengo.Network:
    arguments = key_values.parse(pairs, make, f"network '{spec}'")
    try:
        inspect.signature(make).bind(**arguments)
    except TypeError as error:
        raise UsageError(f"{spec}: {error}; give its arguments with --set KEY=VALUE") from None
    try:
        network = make(**arguments)
    except (SpikeportError, *FROM_OUTSIDE):
        raise
    except BaseException as error:  # a user's code may exit, too, which must not look like success
        raise NetworkError(f"{spec}: raised {in_words(error)}") from error
    if not isinstance(network, nengo.Network):
        raise UsageError(f"{spec}: returned {type(network).__name__}, expected nengo.Network")
    return network


def built_in(spec: str, pairs: list[str], chip: str, passes: str | None = None) -> nengo.Network:
    """Build a built-in network, as `find_network` does, without a time limit.

    Raises
    ------
    UsageError
        If a setting is unknown or wrong.
    """
    experiment = _experiment(spec)
    chosen = experiment.settings(
        **key_values.parse(pairs, experiment.settings, f"network '{spec}'")
    )
    passes = experiment.passes(passes)
    options = Options(experiment.seconds, chip=chip, pipeline=passes, cache=cache.of_user())
    return experiment.trial(chosen, options).network()


def _experiment(spec: str) -> Experiment:
    """Return the experiment that runs a built-in network."""
    module = registry.imported(f"network '{spec}'", registry.EXPERIMENTS[BUILT_IN[spec]])
    experiment: Experiment = module.EXPERIMENT
    return experiment
