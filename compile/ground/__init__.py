"""The ground the rooms of compile stand on: names, settings and refusals of a network.

Importing it imports nengo-loihi in silence; modules that use nengo-loihi import this room first.
"""

import contextlib
import sys
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import nengo  # noqa: F401 (before the block, at whose end filters it had set would be lost)
import scipy.special  # noqa: F401 (likewise)

SERVING = {"nengo_extras": "nengo_dl", "networkx": "nxmetis"}
"""Packages that nengo-loihi imports if they are there, and the one without which none is used."""


@contextlib.contextmanager
def _without_idle() -> Iterator[None]:
    """Hide packages that nengo-loihi would import and not use: they take most of its time."""
    modules: dict[str, Any] = sys.modules
    idle = [
        name
        for name, served in SERVING.items()
        if name not in modules and find_spec(served) is None
    ]
    modules.update(dict.fromkeys(idle))
    try:
        yield
    finally:
        for name in idle:
            del modules[name]


with warnings.catch_warnings(), _without_idle():
    # It warns of every nengo newer than 3.2; spikeport.compile.loihi.numpy1 handles what differs.
    warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
    import nengo_loihi  # noqa: F401
