"""A pipeline: the passes of a compile, in order, and one observer that sees every result."""

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
        If passes are not in that order.
    """

    passes: tuple[Pass, ...]

    def __post_init__(self) -> None:
        """Check the order."""
        for before, after in zip(self.passes, self.passes[1:], strict=False):
            if _stage(after) < _stage(before):
                raise UsageError(
                    f"pass {after.name} works on {_kind(after)}, and cannot follow {before.name}, "
                    f"which works on {_kind(before)}; put it before"
                )

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


def _stage(one: Pass) -> int:
    return next(i for i, kind in enumerate(STAGES) if isinstance(one, kind))


def _kind(one: Pass) -> str:
    return ("networks", "blocks", "images")[_stage(one)]


def silent(_one: Pass, _value: Any) -> None:
    """Observe nothing."""
