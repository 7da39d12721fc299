"""Passes by name."""

import pytest

from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.registry import PASSES, PIPELINES, get
from spikeport.errors import UsageError


@pytest.mark.parametrize("name", PASSES)
def test_a_pass_has_the_name_it_is_found_by(name: str) -> None:
    assert get(name).name == name


def test_an_unknown_name_lists_those_there_are() -> None:
    with pytest.raises(UsageError) as caught:
        get("pak")
    known = ", ".join(sorted([*PIPELINES, *PASSES]))
    assert str(caught.value) == f"unknown pass or pipeline 'pak'; there is: {known}"


def test_a_pipeline_within_another_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        get("as_written")
    assert str(caught.value) == (
        "'as_written' is a whole pipeline: write it alone, or the passes it has: "
        "merge_axons,split,pack,place"
    )


@pytest.mark.parametrize("name", PIPELINES)
def test_a_named_pipeline_has_its_passes_in_the_order_of_the_list(name: str) -> None:
    names = [one.name for one in parse(name).passes]
    assert ",".join(names) == PIPELINES[name]
    assert names == [one for one in PASSES if one in names]
