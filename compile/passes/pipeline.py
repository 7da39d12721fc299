"""A pipeline: the passes of a compile, in order, and one observer that sees every result."""

import itertools
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from spikeport.compile.passes.base import BlockPass, Context, ImagePass, NetworkPass, Pass
from spikeport.errors import UsageError
from spikeport.hardware_models.chip import Chip

STAGES = (NetworkPass, BlockPass, ImagePass)
Observer = Callable[[Pass, Any], None]
"""Called after every pass with the pass and the value it left."""


@dataclass(frozen=True)
class Pipeline:
    """The passes of a compile: those of networks first, then of blocks, then of images.

    Raises
    ------
    UsageError
        If passes are not in that order, one would undo another, or one is there twice.
    """

    passes: tuple[Pass, ...]

    def __post_init__(self) -> None:
        """Check the order."""
        for before, after in itertools.combinations(self.passes, 2):
            _check_order(before, after)

    def stage(self, kind: type[Pass]) -> tuple[Pass, ...]:
        """The passes of one stage."""
        return tuple(one for one in self.passes if isinstance(one, kind))


class PassRun:
    """One compile's walk through a pipeline: applies passes, collects their notes."""

    def __init__(self, pipeline: Pipeline, chip: Chip, dt_s: float, observer: Observer) -> None:
        self._pipeline = pipeline
        self._chip = chip
        self._dt_s = dt_s
        self._observe = observer
        self.record: list[dict[str, Any]] = []

    @property
    def rewrites(self) -> bool:
        """Whether the network itself is rewritten."""
        return bool(self._pipeline.stage(NetworkPass))

    def apply(self, kind: type[Pass], value: Any) -> Any:
        """Apply the passes of one stage, in order, to a value."""
        for one in self._pipeline.stage(kind):
            value = self._apply(one, value)
        return value

    def _apply(self, one: Any, value: Any) -> Any:
        notes: dict[str, Any] = {}
        result = one.apply(value, Context(self._chip, self._dt_s, notes.__setitem__))
        value = value if result is None else result  # block passes work in place
        self.record.append({"name": one.name, "options": asdict(one), "notes": notes})
        self._observe(one, value)
        return value


def _check_order(before: Pass, after: Pass) -> None:
    if after.name == before.name:
        raise UsageError(f"pass {after.name} is there twice; give it once, with all its options")
    if _stage(after) < _stage(before):
        raise UsageError(
            f"pass {after.name} works on {kind(after)}, and cannot follow {before.name}, "
            f"which works on {kind(before)}; put it before"
        )
    if before.name in after.precedes:
        raise UsageError(f"pass {after.name} cannot follow {before.name}; put it before")


def _stage(one: Pass | type[Pass]) -> int:
    cls = one if isinstance(one, type) else type(one)
    return next(i for i, stage in enumerate(STAGES) if issubclass(cls, stage))


def kind(one: Pass | type[Pass]) -> str:
    """What a pass works on."""
    return ("networks", "blocks", "images")[_stage(one)]


def silent(_one: Pass, _value: Any) -> None:
    """Observe nothing."""
