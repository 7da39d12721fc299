"""Texts that list passes with their options."""

import re
from pathlib import Path

import pytest

from spikeport.compile.passes.pack import Pack
from spikeport.compile.passes.parse import parse, targeted
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.passes.place import Place
from spikeport.compile.passes.registry import PIPELINES
from spikeport.compile.passes.split import Split
from spikeport.compile.passes.tie import Tie
from spikeport.errors import ChipFileError, UsageError
from tests.helpers.chip_files import chip_file


@pytest.mark.parametrize("text", ["", "  "])
def test_an_empty_text_gives_a_pipeline_without_passes(text: str) -> None:
    assert parse(text) == Pipeline(())


@pytest.mark.parametrize(
    "text",
    [
        "split,pack{effort=2},place",
        " split , pack{ effort = 2 } , place ",
        'split{},pack{effort="2"},place{}',
    ],
)
def test_a_text_lists_passes_with_their_options(text: str) -> None:
    assert parse(text) == Pipeline((Split(), Pack(effort=2), Place()))


def test_the_name_of_a_pipeline_stands_for_its_passes() -> None:
    alone = parse("compact").passes
    assert parse(" tie , compact").passes == (Tie(), *alone)
    assert [one.name for one in alone] == PIPELINES["compact"].split(",")


@pytest.mark.parametrize("passes", [None, "as_written"])
def test_the_pipeline_of_a_chip_file_is_refused_with_file_and_key(
    tmp_path: Path, passes: str | None
) -> None:
    path = chip_file(tmp_path / "my.toml", pipeline="foo")
    start = f"{path}: not a chip:\n  pipeline: unknown pass or pipeline 'foo'; choose from: "
    with pytest.raises(ChipFileError, match=f"^{re.escape(start)}"):
        targeted(str(path), passes)


def test_a_pipeline_with_options_is_refused() -> None:
    with pytest.raises(
        UsageError, match="'compact' is a pipeline and takes no options: leave these out"
    ):
        parse("compact{effort=2}")


def test_a_pass_takes_several_options() -> None:
    assert parse("pack{effort=0,exact=true}").passes == (Pack(effort=0, exact=True),)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("split,pack{efort=2}", "unknown option of pass pack 'efort'; choose from: effort, exact"),
        ("split{effort=2}", "unknown option of pass split 'effort'; it takes none"),
        (
            "pack{effort=two}",
            "pass pack: effort=two: expected a whole number",
        ),
        (
            "pack{effort=-1}",
            "pass pack: effort=-1: input should be greater than or equal to 0",
        ),
        (
            "pack{exact=perhaps}",
            "pass pack: exact=perhaps: expected true or false",
        ),
        (
            "decode_path{slack_cores=few}",
            "pass decode_path: slack_cores=few: expected a number",
        ),
        (
            "decode_path{default=moon}",
            "pass decode_path: default=moon: expected 'auto', 'direct', 'onoff', 'preset10' or "
            "'host'",
        ),
        (
            "fuse{max_neurons=0}",
            "pass fuse: max_neurons=0: input should be greater than or equal to 1",
        ),
        ("pack{effort=1,effort=2}", "pass pack: effort: given twice"),
        (
            "split,pack{effort=2",
            "passes 'split,pack{effort=2': cannot be read from 'pack{effort=2' on; write them as "
            "name,name{key=value,key=value}",
        ),
        (
            "pack{effort}",
            "passes 'effort': cannot be read from 'effort' on; write them as "
            "name,name{key=value,key=value}",
        ),
        ("pack,pack", "pass pack is there twice; give it once, with all its options"),
        ("place,pack", "pass pack cannot follow place; put it before place"),
        ("pack,split", "pass split cannot follow pack; put it before pack"),
        (
            "pack,fuse",
            "pass fuse works on networks, and cannot follow pack, which works on images; "
            "put it before pack",
        ),
    ],
)
def test_a_wrong_text_is_refused_with_the_reason(text: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse(text)
    assert str(caught.value) == message


def test_the_error_of_an_unknown_pass_lists_the_known_ones() -> None:
    known = r"^unknown pass or pipeline 'pak'; choose from: as_written, compact, .*merge_axons.*"
    with pytest.raises(UsageError, match=known):
        parse("split,pak")
