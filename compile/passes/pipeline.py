"""A pipeline: the passes of a compile, in order, and one observer of every result."""

import itertools
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TypeAlias

from spikeport.compile.ground.refusal import ArgumentError
from spikeport.compile.ground.rewrite import Rewrite
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.loihi.blocks import FloatBlocks
from spikeport.compile.passes.base import (
    AnyPass,
    BlockPass,
    Context,
    ImagePass,
    NetworkPass,
    Pass,
    Value,
)
from spikeport.errors import UsageError
from spikeport.hardware_models.chip import ChipModel
from spikeport.key_values import check_fields

STAGES = (NetworkPass, BlockPass, ImagePass)
Observer: TypeAlias = Callable[[AnyPass, Rewrite | FloatBlocks | ChipImage], None]
"""An observer, called after every pass with the pass and the value that it returned."""


@dataclass(frozen=True)
class Pipeline:
    """The passes of a compile: passes over networks first, then over blocks, then over images.

    Raises
    ------
    UsageError
        If passes are not in that order, a pass would undo another, a pass appears twice, or an
        option is out of its bounds.
    ArgumentError
        If an element is not a pass.
    """

    passes: tuple[AnyPass, ...]

    def __post_init__(self) -> None:
        """Check the passes, and their order."""
        for one in self.passes:
            if not isinstance(one, Pass):
                expected = "a pass; give a text directly to `compile_network`: pipeline='fuse,pack'"
                raise ArgumentError("passes", one, expected)
            check_fields(one, f"pass {one.name}: ")
        for before, after in itertools.combinations(self.passes, 2):
            _check_order(before, after)

    @property
    def networks(self) -> tuple[NetworkPass, ...]:
        """The passes of networks."""
        return tuple(one for one in self.passes if isinstance(one, NetworkPass))

    @property
    def blocks(self) -> tuple[BlockPass, ...]:
        """The passes of blocks."""
        return tuple(one for one in self.passes if isinstance(one, BlockPass))

    @property
    def images(self) -> tuple[ImagePass, ...]:
        """The passes of images."""
        return tuple(one for one in self.passes if isinstance(one, ImagePass))


def announce_nothing(_name: str) -> None:
    """Announce nothing as a pass begins."""


class PassRun:
    """A run of a pipeline, which applies its passes and collects their notes.

    ``begin`` is called with the name of each pass before the pass, the observer after it.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        chip: ChipModel,
        dt_s: float,
        observer: Observer,
        begin: Callable[[str], None] = announce_nothing,
    ) -> None:
        self._begin = begin
        self._pipeline = pipeline
        self._chip = chip
        self._dt_s = dt_s
        self._observe = observer
        self.record: list[dict[str, object]] = []

    @property
    def rewrites(self) -> bool:
        """True if a pass rewrites the network itself."""
        return bool(self._pipeline.networks)

    def networks(self, rewrite: Rewrite) -> Rewrite:
        """Apply the passes of networks, in order."""
        return self._apply(self._pipeline.networks, rewrite)

    def blocks(self, floats: FloatBlocks) -> FloatBlocks:
        """Apply the passes of blocks, in order."""
        return self._apply(self._pipeline.blocks, floats)

    def images(self, image: ChipImage) -> ChipImage:
        """Apply the passes of images, in order."""
        return self._apply(self._pipeline.images, image)

    def _apply(self, passes: tuple[Pass[Value], ...], value: Value) -> Value:
        for one in passes:
            self._begin(one.name)
            notes: dict[str, object] = {}
            after = self._pipeline.passes[self._pipeline.passes.index(one) + 1 :]
            value = one.apply(value, Context(self._chip, self._dt_s, notes.__setitem__, after))
            self.record.append({"name": one.name, "options": asdict(one), "notes": notes})
            self._observe(one, value)
        return value


def _check_order(before: AnyPass, after: AnyPass) -> None:
    if after.name == before.name:
        raise UsageError(f"pass {after.name} is there twice; give it once, with all its options")
    if _stage(after) < _stage(before):
        raise UsageError(
            f"pass {after.name} works on {kind(after)}, and cannot follow {before.name}, "
            f"which works on {kind(before)}; put it before {before.name}"
        )
    if before.name in after.precedes:
        raise UsageError(
            f"pass {after.name} cannot follow {before.name}; put it before {before.name}"
        )


def _stage(one: AnyPass | type[AnyPass]) -> int:
    cls = one if isinstance(one, type) else type(one)
    return next(i for i, stage in enumerate(STAGES) if issubclass(cls, stage))


def kind(one: AnyPass | type[AnyPass]) -> str:
    """Return the kind of value that a pass works on."""
    return ("networks", "blocks", "images")[_stage(one)]


def observe_nothing(_one: AnyPass, _value: object) -> None:
    """Observe nothing."""
