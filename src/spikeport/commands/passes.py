"""``spikeport passes``, and the passes of a compile on the screen."""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Literal, get_args, get_origin

from spikeport.commands.console import Console, ScreenTable
from spikeport.compile.passes import registry
from spikeport.compile.passes.base import AnyPass
from spikeport.compile.passes.dump import dump
from spikeport.compile.passes.parse import options
from spikeport.compile.passes.pipeline import Observer, Pipeline, kind, observe_nothing
from spikeport.compile.report.report import Json, Report
from spikeport.errors import printable, unknown
from spikeport.hardware_models import chip as chips

ALL = "all"


def print_passes() -> None:
    """Print all passes, in the order a pipeline may have them, and the pipelines of the chips."""
    console = Console()
    table = ScreenTable("pass", "works on", "options", "what it does")
    for name in registry.PASSES:
        cls = registry.get(name)
        summary = (cls.__doc__ or "").split("\n\n")[0]
        table.add_row(name, kind(cls), _options(cls), " ".join(summary.split()))
    console.print(table)
    for name, text in registry.PIPELINES.items():
        console.print(f"{name}: {text}", soft_wrap=True)
    for name in chips.names():
        console.print(f"default of {name}: {chips.get(name).pipeline or 'none'}")


def _options(cls: type[AnyPass]) -> str:
    kinds = options(cls)
    return ", ".join(f"{key}: {_type(kind)} = {getattr(cls, key)}" for key, kind in kinds.items())


def _type(hint: object) -> str:
    if get_origin(hint) is Literal:
        return " | ".join(map(str, get_args(hint)))
    if get_args(hint):  # with its bounds, or with None, which the default shows
        return _type(get_args(hint)[0])
    assert isinstance(hint, type)
    return hint.__name__


def printer(chosen: str | None, pipeline: Pipeline) -> Observer:
    """Return an observer that prints the result of the chosen pass, or of every pass.

    Raises
    ------
    UsageError
        If the pipeline has no such pass.
    """
    if chosen is None:
        return observe_nothing
    names = [one.name for one in pipeline.passes]
    if chosen not in (ALL, *names):
        raise unknown("pass of this compile", chosen, [ALL, *names])

    def show(one: AnyPass, value: object) -> None:
        if chosen in (ALL, one.name):
            print("\n  ".join([f"after {one.name}:", *map(printable, dump(value))]), end="\n\n")

    return show


def pass_lines(report: Report) -> Iterator[str]:
    """Yield a line for each pass: ``pack: cores 26 -> 6``, ``decode_path: 3 direct``."""
    for done in report.passes:
        notes = {key: note for key, note in done["notes"].items() if isinstance(note, dict)}
        if parts := [*_changes(notes), *_choices(notes)]:
            yield f"{done['name']}: {', '.join(parts)}"


def _changes(notes: Mapping[str, Json]) -> Iterator[str]:
    for key, note in notes.items():
        if set(note) == {"before", "after"} and note["before"] != note["after"]:
            before, after = (_figure(note[when]) for when in ("before", "after"))
            yield f"{key.replace('_', ' ')} {before} -> {after}"


def _figure(value: float | None) -> str:
    if value is None:
        return "none"
    return f"{value:,}" if isinstance(value, int) else f"{value:.3g}"


def _choices(notes: Mapping[str, Json]) -> Iterator[str]:
    """Yield each choice of a pass, and how often it was made."""
    chosen = Counter(note["chosen"] for note in notes.values() if "chosen" in note)
    yield from (f"{n:,} {what}" for what, n in sorted(chosen.items()))
