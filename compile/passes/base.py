"""The three kinds of passes: named, frozen sets of options with one method."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeAlias, TypeVar

from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi.blocks import FloatBlocks
from spikeport.hardware_models.chip import ChipModel

Value = TypeVar("Value", Rewrite, FloatBlocks, ChipImage)


@dataclass(frozen=True)
class Context:
    """The chip and time step of a compile, and a place for the findings of a pass.

    ``note(key, value)`` keeps a finding, plain data ready for JSON, under the pass that made it.
    ``following`` are the passes after this one, for what depends on their result.
    """

    chip: ChipModel
    dt_s: float
    note: Callable[[str, object], None]
    following: "tuple[AnyPass, ...]" = ()


@dataclass(frozen=True)
class Pass(ABC, Generic[Value]):
    """One step of a pipeline. Options are the fields of the frozen dataclass that derives from it.

    Attributes
    ----------
    name : str
        Its name in ``--passes``; its docstring's first line is its description.
    precedes : tuple of str
        Names of passes that would undo it, or that it would undo, and that it must come before.
    """

    name: ClassVar[str]
    precedes: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def apply(self, value: Value, /, context: Context) -> Value:
        """Return a changed value; the one before stays as it is."""


@dataclass(frozen=True)
class NetworkPass(Pass[Rewrite]):
    """A pass that rewrites a network such that its float behaviour is equal, to rounding.

    `Tie` changes it, and notes by how much; `ConstantInputs` changes the first steps, and `Fuse`
    cuts off sums beyond the radius.
    """


@dataclass(frozen=True)
class BlockPass(Pass[FloatBlocks]):
    """A pass that turns float blocks into others that behave alike and lose less by rounding."""


@dataclass(frozen=True)
class ImagePass(Pass[ChipImage]):
    """A pass that places or wires an image differently, such that it computes the same integers."""


AnyPass: TypeAlias = Pass[Rewrite] | Pass[FloatBlocks] | Pass[ChipImage]
