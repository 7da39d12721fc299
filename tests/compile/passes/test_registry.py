"""Passes and pipelines by name."""

import nengo
import pytest

from spikeport.compile.passes.parse import parse
from spikeport.compile.passes.registry import PASSES, PIPELINES, get
from spikeport.compile.pipeline import compile_network
from spikeport.errors import UsageError


@pytest.mark.parametrize("name", PASSES)
def test_a_pass_has_the_name_it_is_found_by(name: str) -> None:
    assert get(name).name == name


def test_the_error_of_an_unknown_name_lists_the_known_names() -> None:
    with pytest.raises(UsageError) as caught:
        get("pak")
    known = ", ".join(sorted([*PIPELINES, *PASSES]))
    assert str(caught.value) == f"unknown pass or pipeline 'pak'; choose from: {known}"


def test_a_pipeline_in_place_of_a_pass_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        get("as_written")
    assert str(caught.value) == (
        "'as_written' is a pipeline and takes no options: leave these out, or list its passes: "
        "merge_axons,split,pack,place"
    )


@pytest.mark.parametrize("name", PIPELINES)
def test_a_named_pipeline_has_its_passes_in_the_order_of_the_list(name: str) -> None:
    names = [one.name for one in parse(name).passes]
    assert ",".join(names) == PIPELINES[name]
    assert names == [one for one in PASSES if one in names]


@pytest.mark.parametrize("name", ["unpacked", "compact_unpacked"])
def test_unpacked_pipelines_put_each_block_on_a_core_of_its_own(name: str) -> None:
    image = compile_network(two_ensembles(), pipeline=name).image
    assert image.n_blocks > 1
    assert sorted(image.blocks.core) == list(range(image.n_blocks))


def two_ensembles() -> nengo.Network:
    with nengo.Network(seed=2) as network:
        first, second = nengo.Ensemble(20, 1), nengo.Ensemble(20, 1)
        nengo.Connection(nengo.Node(0.5), first)
        nengo.Connection(first, second)
        nengo.Probe(second)
    return network
