"""Pipelines, which apply their passes in order and record their notes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

from spikeport.compile.passes.base import AnyPass, BlockPass, Context, ImagePass, NetworkPass
from spikeport.compile.passes.fuse import Fuse
from spikeport.compile.passes.pack import Pack
from spikeport.compile.passes.pipeline import PassRun, Pipeline, kind, observe_nothing
from spikeport.errors import UsageError
from spikeport.hardware_models import chip as chips

LOIHI = chips.get("loihi")


class Noting:
    """Pass that appends its name to a text that stands for the value."""

    def apply(self, value: str, /, context: Context) -> str:
        context.note("before", value)
        return f"{value} {self.name}".strip()


@dataclass(frozen=True)
class Network(Noting, NetworkPass):
    name: ClassVar[str] = "network"
    size: int = 3


@dataclass(frozen=True)
class Block(Noting, BlockPass):
    name: ClassVar[str] = "block"


@dataclass(frozen=True)
class First(Noting, ImagePass):
    name: ClassVar[str] = "first"
    precedes: ClassVar[tuple[str, ...]] = ("second",)


@dataclass(frozen=True)
class Second(Noting, ImagePass):
    name: ClassVar[str] = "second"


@pytest.mark.parametrize("passes", [("fuse",), ("fuse", "pack"), (Network(), None)])
def test_an_object_that_is_not_a_pass_is_refused(passes: Any) -> None:
    with pytest.raises(UsageError, match=r"^passes=.*: expected a pass; give a text directly to"):
        Pipeline(passes)


@pytest.mark.parametrize(
    ("one", "message"),
    [
        (lambda: Pack(effort="high"), "pass pack: effort=high: input should be a valid integer"),
        (lambda: Pack(effort=17), "pass pack: effort=17: input should be less than or equal to 16"),
        (lambda: Fuse(max_neurons=-3), "pass fuse: max_neurons=-3: input should be greater than"),
    ],
)
def test_options_that_are_set_in_python_are_checked_too(
    one: Callable[[], AnyPass], message: str
) -> None:
    with pytest.raises(UsageError, match=f"^{message}"):
        Pipeline((one(),))


def test_each_stage_has_its_passes_in_order() -> None:
    pipeline = Pipeline((Network(), Block(), First(), Second()))
    assert pipeline.networks == (Network(),)
    assert pipeline.blocks == (Block(),)
    assert pipeline.images == (First(), Second())


def test_passes_run_in_order_and_leave_a_record() -> None:
    seen: list[tuple[str, Any]] = []
    pipeline = Pipeline((Network(size=5), First(), Second()))
    begun: list[str] = []
    run = PassRun(
        pipeline, LOIHI, 0.001, lambda one, value: seen.append((one.name, value)), begun.append
    )
    assert run.rewrites
    assert (run.networks("n"), run.blocks("b"), run.images("i")) == (
        "n network",
        "b",
        "i first second",
    )
    assert seen == [("network", "n network"), ("first", "i first"), ("second", "i first second")]
    assert run.record == [
        {"name": "network", "options": {"size": 5}, "notes": {"before": "n"}},
        {"name": "first", "options": {}, "notes": {"before": "i"}},
        {"name": "second", "options": {}, "notes": {"before": "i first"}},
    ]


def test_the_context_of_a_pass_lists_the_passes_that_follow() -> None:
    following = []

    @dataclass(frozen=True)
    class Curious(Network):
        def apply(self, value: Any, /, context: Context) -> Any:
            following.append(context.following)
            return value

    run = PassRun(Pipeline((Curious(), Block(), Second())), LOIHI, 0.001, observe_nothing)
    run.networks("n")
    assert following == [(Block(), Second())]


def test_without_passes_nothing_changes() -> None:
    run = PassRun(Pipeline(()), LOIHI, 0.001, observe_nothing, print)
    assert not run.rewrites
    assert (run.images("i"), run.record) == ("i", [])


@pytest.mark.parametrize(
    ("passes", "message"),
    [
        ((Second(), First()), "pass first cannot follow second; put it before second"),
        ((First(), First()), "pass first is there twice; give it once, with all its options"),
        (
            (First(), Network()),
            "pass network works on networks, and cannot follow first, which works on images; "
            "put it before first",
        ),
        (
            (First(), Block()),
            "pass block works on blocks, and cannot follow first, which works on images; "
            "put it before first",
        ),
    ],
)
def test_passes_in_a_wrong_order_or_twice_are_refused(
    passes: tuple[Any, ...], message: str
) -> None:
    with pytest.raises(UsageError) as caught:
        Pipeline(passes)
    assert str(caught.value) == message


def test_the_kind_of_a_pass_is_that_of_its_values() -> None:
    assert [kind(one) for one in (Network, Block(), First)] == ["networks", "blocks", "images"]
