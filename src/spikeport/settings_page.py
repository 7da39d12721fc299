"""The page of settings, which ``run EXPERIMENT --set KEY=VALUE`` takes, made from their classes."""

import dataclasses
import inspect
import types
from collections.abc import Iterator
from typing import Any, get_args

from spikeport import key_values
from spikeport.experiments import registry

HEAD = """# Settings

This page lists the settings of all experiments, which `run`, `sweep` and `figure` take as `--set
KEY=VALUE`. `calibrate` takes those that change the neurons: it refuses perturbations, `calibrated`,
and settings of a run alone (`path`, `speed` and `ramp` of `walk`; `digit` and `recognise` of
`draw`). `compile arm` takes those of `reach`, `compile walk` those of `walk`, `compile humanoid`
those of `switch`. `evaluate` takes those of [PolicySettings](#policysettings) without `appearance`,
and perturbations by its `--row`. Every setting can be left out; where it has no default here, its
description says which value holds then. An experiment has the settings of its own section, and
those of the sections that it names.

This page is made from the classes of the settings by `python -m spikeport.documents docs`."""

WORDS = {int: "whole number", float: "number", bool: "true or false", str: "text"}


def page() -> str:
    """Return the settings of every experiment, as Markdown.

    Raises
    ------
    MissingExtraError
        If a package that an experiment needs is absent.
    """
    classes = {name: registry.get(name).settings for name in registry.EXPERIMENTS}
    takers: dict[type, list[str]] = {}
    for name, settings in classes.items():
        for shared in _shared(settings):
            takers.setdefault(shared, []).append(name)
    parts = [HEAD]
    for name, settings in classes.items():
        others = " and ".join(_link(one) for one in _shared(settings))
        parts += [f"## {name}", f"It has the settings of {others}, too.", *_section(settings)]
    for shared, names in takers.items():
        users = " and ".join(f"[{name}](#{name})" for name in names)
        parts += [f"## {shared.__name__}", f"Settings of {users}.", *_section(shared)]
    return "\n\n".join(parts) + "\n"


def _shared(settings: type) -> list[type]:
    """Return the classes that settings are derived from, the nearest one first."""
    return [one for one in settings.__mro__[1:] if dataclasses.is_dataclass(one)]


def _link(settings: type) -> str:
    return f"[{settings.__name__}](#{settings.__name__.lower()})"


def _section(settings: type) -> Iterator[str]:
    """Yield the table of a class's own settings, and the docstring of the class."""
    kinds = key_values.parameters(settings, settings.__name__)
    defaults = {one.name: one.default for one in dataclasses.fields(settings)}
    own = [name for name in inspect.get_annotations(settings) if name in defaults]
    rows = (f"| `{name}` | {_kind(kinds[name])} | {_default(defaults[name])} |" for name in own)
    yield "\n".join(("| setting | type | default |", "|---|---|---|", *rows))
    text = " ".join(inspect.cleandoc(settings.__doc__ or "").split()).replace("``", "`")
    for shared in _shared(settings):
        for name in (f"{shared.__module__}.{shared.__name__}", shared.__name__):
            text = text.replace(f"`{name}`", _link(shared))
    yield text


def _kind(kind: Any) -> str:
    """Return a type in words, without None, which cannot be set."""
    members = [one for one in get_args(kind) or (kind,) if one is not types.NoneType]
    return ", or ".join(WORDS.get(one, str(one)) for one in members)


def _default(value: object) -> str:
    if value is None:
        return ""
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"
