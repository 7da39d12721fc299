"""nengo-loihi's hardware half, imported with an NxSDK of choice.

nengo-loihi looks for NxSDK once, when it is imported, and keeps what it finds. So the modules that
keep NxSDK are imported a second time, with the other NxSDK in place of the package; the first
import does not change.
"""

import contextlib
import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any, NamedTuple

from spikeport.errors import MissingExtraError

KEEPERS = tuple(f"nengo_loihi.hardware.{name}" for name in ("nxsdk_shim", "builder", "interface"))
"""The modules that keep what they find of NxSDK, in the order they import each other."""


class HardwareModules(NamedTuple):
    """nengo-loihi's hardware half: its modules ``builder`` and ``interface``."""

    builder: Any
    interface: Any

    def allow_profiles(self, compartments: int, thresholds: int) -> None:
        """Let this import of the builder accept as many profiles on a core as the chip has."""
        # nengo-loihi asserts that there are fewer than these.
        self.builder.MAX_COMPARTMENT_CFGS = compartments + 1
        self.builder.MAX_VTH_CFGS = thresholds + 1


def recording_hardware(modules: Mapping[str, ModuleType]) -> HardwareModules:
    """Import the hardware half with a recording NxSDK.

    Parameters
    ----------
    modules : mapping of str to module
        The return value of `spikeport.backends.board.nxsdk.package.modules`.
    """
    with _in_place({**dict.fromkeys(KEEPERS), **modules}):
        _, builder, interface = map(import_module, KEEPERS)
    return HardwareModules(builder, interface)


def require_nxsdk() -> None:
    """Look for NxSDK.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    if find_spec("nxsdk") is None:
        raise MissingExtraError(
            "no NxSDK is installed here: Intel gives it to members of its research community "
            "(INRC), and pip cannot install it; without it, `board check` compares what would be "
            "written, and `board serve --machine snips` steps it"
        )


def real_hardware() -> HardwareModules:
    """Return the hardware half on the NxSDK of this machine; MissingExtraError if there is none."""
    require_nxsdk()
    _, builder, interface = map(import_module, KEEPERS)
    return HardwareModules(builder, interface)


@contextlib.contextmanager
def _in_place(modules: Mapping[str, ModuleType | None]) -> Iterator[None]:
    """Replace modules, or remove a module whose replacement is None; restore them at the end."""
    package = sys.modules["nengo_loihi.hardware"]
    before = {name: sys.modules.get(name) for name in modules}
    # An import also sets the module as an attribute of its package.
    attributes = dict(vars(package))
    _put(modules)
    try:
        yield
    finally:
        _put(before)
        vars(package).update(attributes)


def _put(modules: Mapping[str, ModuleType | None]) -> None:
    for name, module in modules.items():
        if module is None:
            sys.modules.pop(name, None)
        else:
            sys.modules[name] = module
