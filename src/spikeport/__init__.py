"""spikeport: Nengo networks on Loihi-style neuromorphic chips, in closed loop with a robot."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spikeport.compile.ground.settings import add_params
    from spikeport.compile.image.chip_image import ChipImage
    from spikeport.compile.pipeline import Compilation, compile_network
    from spikeport.simulator import Simulator

__version__ = "0.1.0"
__all__ = ["ChipImage", "Compilation", "Simulator", "add_params", "compile_network"]

_HOMES = {
    "ChipImage": "spikeport.compile.image.chip_image",
    "Compilation": "spikeport.compile.pipeline",
    "Simulator": "spikeport.simulator",
    "add_params": "spikeport.compile.ground.settings",
    "compile_network": "spikeport.compile.pipeline",
}


def __getattr__(name: str) -> object:
    # Loaded when first used: nengo and nengo-loihi take a second, which `--help` need not wait for.
    if name not in _HOMES:
        raise AttributeError(f"module 'spikeport' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)
