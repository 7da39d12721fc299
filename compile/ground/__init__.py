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


@contextlib.contextmanager
def _without_extras() -> Iterator[None]:
    """Hide nengo-extras: nengo-loihi takes builders for NengoDL from it, and most of its time."""
    modules: dict[str, Any] = sys.modules
    if "nengo_extras" in modules or find_spec("nengo_dl") is not None:
        yield
        return
    modules["nengo_extras"] = None
    try:
        yield
    finally:
        del modules["nengo_extras"]


with warnings.catch_warnings(), _without_extras():
    # It warns of every nengo newer than 3.2; spikeport.compile.loihi.numpy1 handles what differs.
    warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
    import nengo_loihi  # noqa: F401
