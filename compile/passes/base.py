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

    ``note(key, value)`` adds a finding, as plain data for JSON, to the record of the pass.
    ``following`` has the passes after this one, for a pass that depends on their result.
    """

    chip: ChipModel
    dt_s: float
    note: Callable[[str, object], None]
    following: "tuple[AnyPass, ...]" = ()

    def note_change(self, key: str, before: object, after: object) -> None:
        """Note a figure before and after the pass."""
        self.note(key, {"before": before, "after": after})


@dataclass(frozen=True)
class Pass(ABC, Generic[Value]):
    """One step of a pipeline. A subclass is a frozen dataclass whose fields are the options.

    Attributes
    ----------
    name : str
        The name in ``--passes``. The first line of the docstring is the description.
    precedes : tuple of str
        Names of passes that this pass must come before, since one would undo the other.
    """

    name: ClassVar[str]
    precedes: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def apply(self, value: Value, /, context: Context) -> Value:
        """Return a changed value; the argument stays as it is."""


@dataclass(frozen=True)
class NetworkPass(Pass[Rewrite]):
    """A pass that rewrites a network but keeps its float behaviour, up to rounding.

    There are exceptions: `Tie` changes decoded values, and notes by how much; `ConstantInputs`
    changes the first steps; passes that regroup ensembles cut off sums beyond the radius.
    """


@dataclass(frozen=True)
class BlockPass(Pass[FloatBlocks]):
    """A pass that changes float blocks so that they behave the same but lose less by rounding."""


@dataclass(frozen=True)
class ImagePass(Pass[ChipImage]):
    """A pass that places or wires an image differently; it still computes the same integers."""


AnyPass: TypeAlias = Pass[Rewrite] | Pass[FloatBlocks] | Pass[ChipImage]
