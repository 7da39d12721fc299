"""The backends there are, and how each opens a network."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import nengo

from spikeport.backends.chip import Chip
from spikeport.backends.execution import Execution
from spikeport.backends.host_loop import HostLoop
from spikeport.backends.nengo_loihi import NengoLoihiChip
from spikeport.backends.reference import Reference
from spikeport.compile.image import ChipImage
from spikeport.compile.pipeline import Compilation, compile_network
from spikeport.errors import unknown

Open = Callable[[nengo.Network, str | Path, float, int, Compilation | None], Execution]
"""Opens a network, given the chip, the time step in seconds, a seed and, where the network was
opened before, what it was compiled to."""


@dataclass(frozen=True)
class Backend:
    """One way to run a network."""

    name: str
    summary: str
    open: Open


def _on(load: Callable[[ChipImage, int], Chip]) -> Open:
    """Compile a network, load its image with ``load``, and keep the rest on the host."""

    def open_network(
        network: nengo.Network,
        chip: str | Path,
        dt_s: float,
        seed: int,
        compilation: Compilation | None,
    ) -> Execution:
        compiled = compilation or compile_network(network, chip, dt_s)
        return HostLoop(compiled, load(compiled.image, seed), seed)

    return open_network


def _without_chip(
    network: nengo.Network,
    _chip: str | Path,
    dt_s: float,
    seed: int,
    _compilation: Compilation | None,
) -> Execution:
    return Reference(network, dt_s, seed)


def _native(image: ChipImage, seed: int) -> Chip:
    from spikeport.backends.native.chip import NativeChip  # loads the kernels: not before use

    return NativeChip(image, seed)


BACKENDS = {
    backend.name: backend
    for backend in (
        Backend("reference", "float Nengo, no chip: what the network computes", _without_chip),
        Backend(
            "native", "the image on compiled kernels, equal to nengo-loihi's emulator", _on(_native)
        ),
        Backend("nengo-loihi", "the image on nengo-loihi's emulator", _on(NengoLoihiChip)),
    )
}


def get(name: str) -> Backend:
    """The backend of that name.

    Raises
    ------
    UsageError
        If there is none; lists those there are.
    """
    if name not in BACKENDS:
        raise unknown("backend", name, BACKENDS)
    return BACKENDS[name]
