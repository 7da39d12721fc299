"""spikeport: Nengo networks on Loihi-style neuromorphic chips, in closed loop with a robot.

A network is compiled for a chip, and runs on an emulator that computes the chip's own integers:

    >>> import nengo
    >>> import spikeport
    >>> with nengo.Network(seed=0) as network:
    ...     command = nengo.Node([0.5])
    ...     neurons = nengo.Ensemble(100, dimensions=1)
    ...     _ = nengo.Connection(command, neurons)
    ...     output = nengo.Probe(neurons, synapse=0.02)
    >>> with spikeport.Simulator(network, chip="loihi") as sim:
    ...     sim.run(0.2)
    >>> sim.data[output].shape
    (200, 1)
    >>> sim.report()["resources"]["cores"]["used"]
    1

Or only compile it, and keep the image, which runs without Nengo:

    >>> compilation = spikeport.compile_network(network)
    >>> compilation.image.save("network.npz")

A network that does not fit raises `spikeport.errors.DoesNotFitError`, which lists every limit that
it exceeds, with a cure. The command line does the same, and runs the experiments:
``spikeport --help``.

Subpackages
-----------
networks          spiking controllers, as plain Nengo networks
compile           images of networks, with reports
hardware_models   chips as data: limits, energies, times
backends          emulators that images run on
robot             the Unitree H1 in MuJoCo
training          training of the walking policy
experiments       robots in closed loop with networks
errors            the errors that are raised on purpose
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from spikeport import errors
    from spikeport.compile.ground.settings import add_params, set_defaults
    from spikeport.compile.image.chip_image import ChipImage
    from spikeport.compile.passes.pipeline import Pipeline
    from spikeport.compile.pipeline import Compilation, compile_network
    from spikeport.simulator import Simulator

__version__ = "0.2.0"
__all__ = [
    "ChipImage",
    "Compilation",
    "Pipeline",
    "Simulator",
    "add_params",
    "compile_network",
    "errors",
    "set_defaults",
]

_HOMES = {
    "ChipImage": "spikeport.compile.image.chip_image",
    "Compilation": "spikeport.compile.pipeline",
    "Pipeline": "spikeport.compile.passes.pipeline",
    "Simulator": "spikeport.simulator",
    "add_params": "spikeport.compile.ground.settings",
    "compile_network": "spikeport.compile.pipeline",
    "set_defaults": "spikeport.compile.ground.settings",
}


def __getattr__(name: str) -> object:
    # Loaded when first used: nengo and nengo-loihi take a second, which `--help` need not wait for.
    if name == "errors":
        return import_module("spikeport.errors")
    if name not in _HOMES:
        raise AttributeError(f"module 'spikeport' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    # Names that help() and completion list, without those that only this file needs.
    return [*__all__, "__all__", "__doc__", "__file__", "__name__", "__path__", "__version__"]
