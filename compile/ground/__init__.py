"""Names, settings, refusals and warnings of a network, which all folders of compile use.

This package imports nengo-loihi without its warnings; modules that use nengo-loihi import it first.
"""

import contextlib
import sys
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import nengo  # noqa: F401 (before the block below, which undoes changes of filters)
import scipy.special  # noqa: F401 (likewise)

USED_ONLY_WITH = {"nengo_extras": "nengo_dl", "networkx": "nxmetis"}
"""Packages that nengo-loihi imports if installed, each with the package without which nengo-loihi
does not use it."""


@contextlib.contextmanager
def _without_unused() -> Iterator[None]:
    """Hide packages that nengo-loihi would load but not use: they take most of its loading time."""
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
    # It warns of every Nengo above 3.2; spikeport.compile.loihi.numpy1 handles the differences.
    warnings.filterwarnings("ignore", message="This version of `nengo_loihi`")
    import nengo_loihi  # noqa: F401
