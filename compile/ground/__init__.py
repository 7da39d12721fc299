"""Names, settings and refusals of a network, which all folders of compile use.

Importing it imports nengo-loihi in silence; modules that use nengo-loihi import this package first.
"""

import contextlib
import sys
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import nengo  # noqa: F401 (before the block, at whose end filters it had set would be lost)
import scipy.special  # noqa: F401 (likewise)

USED_ONLY_WITH = {"nengo_extras": "nengo_dl", "networkx": "nxmetis"}
"""Packages that nengo-loihi imports if installed, each with the package it needs to make use of
it."""


@contextlib.contextmanager
def _without_unused() -> Iterator[None]:
    """Hide packages that nengo-loihi would import and not use: they take most of its time."""
    modules: dict[str, Any] = sys.modules
    unused = [
        name
        for name, needed in USED_ONLY_WITH.items()
        if name not in modules and find_spec(needed) is None
    ]
    modules.update(dict.fromkeys(unused))
    try:
        yield
    finally:
        for name in unused:
            del modules[name]


with warnings.catch_warnings(), _without_unused():
    # It warns of every nengo newer than 3.2; spikeport.compile.loihi.numpy1 handles what differs.
    warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
    import nengo_loihi  # noqa: F401
