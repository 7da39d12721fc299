"""The backends there are, what each is for, and what it lacks on this machine."""

from collections.abc import Callable
from dataclasses import dataclass

from spikeport.backends.chip import Chip
from spikeport.compile.image import ChipImage
from spikeport.errors import unknown


@dataclass(frozen=True)
class Backend:
    """One way to run a network.

    ``open_chip`` loads an image, given a seed; None where the backend runs the network itself, in
    floating point, without compiling it.
    """

    name: str
    summary: str
    open_chip: Callable[[ChipImage, int], Chip] | None = None


def _nengo_loihi(image: ChipImage, seed: int) -> Chip:
    from spikeport.backends.nengo_loihi import NengoLoihiChip

    return NengoLoihiChip(image, seed)


BACKENDS = {
    backend.name: backend
    for backend in (
        Backend("reference", "float Nengo, no chip: what the network computes before rounding"),
        Backend("nengo-loihi", "the image on nengo-loihi's integer emulator", _nengo_loihi),
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
