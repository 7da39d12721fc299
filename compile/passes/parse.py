"""The parser of pipelines: ``fuse,pack{effort=2},place``."""

import re

from spikeport.compile.passes import registry
from spikeport.compile.passes.base import AnyPass
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.errors import ChipFileError, UsageError, printable
from spikeport.hardware_models import chip as chips
from spikeport.hardware_models.chip import ChipModel
from spikeport.key_values import converted, parameters

ONE_PASS = re.compile(r"""\s*(?P<name>\w+)\s*(?:\{(?P<options>(?:"[^"]*"|[^{}"])*)\})?\s*(?:,|$)""")
ONE_OPTION = re.compile(
    r"""\s*(?P<key>\w+)\s*=\s*(?:"(?P<quoted>[^"]*)"|(?P<bare>[^,"]*?))\s*(?:,|$)"""
)


def parse(text: str) -> Pipeline:
    """Return the pipeline that a text describes; an empty text describes one without passes.

    The text lists passes, separated by commas. A pass is a name in `registry.PASSES` and, in
    braces, its options: ``key=value``, separated by commas. A value with commas or braces is in
    double quotes. The name of one of `registry.PIPELINES` stands for all of its passes.

    Raises
    ------
    UsageError
        If the text cannot be read, a pass or option is not known, a value is of the wrong type, or
        the passes cannot follow each other; see `Pipeline`.
    """
    pairs = [match.group("name", "options") for match in _matches(ONE_PASS, text)]
    return Pipeline(tuple(one for name, options in pairs for one in _passes(name, options)))


def targeted(name: str, pipeline: Pipeline | str | None) -> tuple[ChipModel, Pipeline]:
    """Return the chip of a name or file, and a pipeline itself, that of a text, or the chip's.

    Raises
    ------
    UsageError, ChipFileError
        As `spikeport.hardware_models.chip.get` and `parse` do. A chip whose own pipeline cannot be
        read is wrong, even if another is asked for.
    """
    chip = chips.get(name)
    try:
        own = parse(chip.pipeline)
    except UsageError as error:
        raise ChipFileError(f"{name}: not a chip:\n  pipeline: {error}") from None
    if pipeline is None:
        return chip, own
    return chip, parse(pipeline) if isinstance(pipeline, str) else pipeline


def _matches(pattern: re.Pattern[str], text: str) -> list[re.Match[str]]:
    """Return the matches of a pattern that together make up a text."""
    matches, at = [], 0
    while text[at:].strip():
        match = pattern.match(text, at)
        if match is None:
            raise UsageError(
                f"passes '{printable(text)}': cannot be read from "
                f"'{printable(text[at:].strip())}' on; write them as "
                "name,name{key=value,key=value}"
            )
        matches.append(match)
        at = match.end()
    return matches


def _passes(name: str, text: str | None) -> tuple[AnyPass, ...]:
    if text is None and name in registry.PIPELINES:
        return parse(registry.PIPELINES[name]).passes
    return (_pass(name, text),)


def _pass(name: str, text: str | None) -> AnyPass:
    cls = registry.get(name)
    pairs = []
    for match in _matches(ONE_OPTION, text or ""):
        key, quoted, bare = match.group("key", "quoted", "bare")
        pairs.append((key, bare if quoted is None else quoted))
    owner = f"pass {name}"
    return cls(**converted(pairs, options(cls), f"option of {owner}", f"{owner}:"))


def options(cls: type[AnyPass]) -> dict[str, object]:
    """Return the type of each option of a pass, by name."""
    return parameters(cls, f"pass {cls.name}")
