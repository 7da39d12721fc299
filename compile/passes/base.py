"""What a pass is: a named, frozen set of options with one method, at one of three stages."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from nengo_loihi.builder import Model

from spikeport.compile.image import ChipImage
from spikeport.compile.rewriting.rewrite import Rewrite
from spikeport.hardware_models.chip import Chip


@dataclass(frozen=True)
class Context:
    """What every pass may know, and where it leaves findings for the report.

    ``note(key, value)`` keeps a finding, plain data ready for JSON, under the pass that made it.
    """

    chip: Chip
    dt_s: float
    note: Callable[[str, Any], None]


class Pass(ABC):
    """One step of a pipeline. Options are the fields of the frozen dataclass that derives from it.

    Attributes
    ----------
    name : str
        What it is called in ``--passes``; its docstring's first line is its description.
    precedes : tuple of str
        Names of passes that would undo it, or that it would undo, and that it must come before.
    """

    name: ClassVar[str]
    precedes: ClassVar[tuple[str, ...]] = ()


class NetworkPass(Pass):
    """Rewrites a network such that its float behaviour is equal, to rounding."""

    @abstractmethod
    def apply(self, rewrite: Rewrite, context: Context) -> Rewrite:
        """Rewrite the network."""


class BlockPass(Pass):
    """Changes nengo-loihi's float blocks before they are discretised, in place, as that does."""

    @abstractmethod
    def apply(self, model: Model, context: Context) -> None:
        """Change the blocks."""


class ImagePass(Pass):
    """Turns an image into one that computes the same integers, placed or wired differently."""

    @abstractmethod
    def apply(self, image: ChipImage, context: Context) -> ChipImage:
        """Change the image."""
