"""`Pack`: blocks that share cores."""

import sys
from typing import Any

import numpy as np
import pytest

import spikeport.compile.passes.pack
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.pack import Pack
from spikeport.compile.placing.exact import ExactPacking, pack_exactly
from spikeport.compile.placing.load import block_loads, capacity, core_loads
from spikeport.compile.placing.lower_bound import lower_bound
from spikeport.compile.placing.packing import pack
from spikeport.compile.placing.problem import Bins, Problem
from spikeport.errors import MissingExtraError
from spikeport.hardware_models.chip import ChipModel
from tests.helpers.images import Block, Group, Parts, Route
from tests.helpers.same_run import assert_same_run, context, small_chip


def busy(n: int, core: int, **settings: Any) -> Block:
    """Return a block whose compartments spike by themselves."""
    return Block(n, core=core, **{"bias": 9_000, "vth": 400} | settings)


def blocks(*sizes: int, **settings: Any) -> ChipImage:
    """Return unconnected blocks, each on a core of its own."""
    return Parts([busy(n, k, vth=2**16, **settings) for k, n in enumerate(sizes)]).image()


def packed(image: ChipImage, chip: ChipModel, **options: Any) -> ChipImage:
    after = Pack(**options).apply(image, context(chip))
    assert all(capacity(chip).holds(load) for load in core_loads(after, chip))
    assert assert_same_run(image, after) > 0
    return after


def test_blocks_share_cores_as_far_as_there_is_room() -> None:
    after = packed(blocks(5, 5, 3, 3, 2, 2), small_chip(compartments=10))
    assert after.n_cores == 2
    assert np.bincount(after.compartment_core).tolist() == [10, 10]


@pytest.mark.parametrize(
    "resource", ["compartments", "in_axons", "out_axons", "synapse_bits", "threshold_profiles"]
)
def test_every_resource_is_limited(resource: str) -> None:
    pairs = [busy(2, k, vth=2**16 + 64 * k) for k in range(4)]
    groups = [Group([[64]] * 2, block=(k + 1) % 4) for k in range(4)]
    routes = [Route([0, 1], block=k, group=k) for k in range(4)]
    image = Parts(pairs, groups, routes=routes).image()
    limit = {"synapse_bits": 4 * 64, "threshold_profiles": 2}.get(resource, 4)
    assert packed(image, small_chip()).n_cores == 1
    assert packed(image, small_chip(**{resource: limit})).n_cores == 2


@pytest.mark.parametrize(
    "settings",
    [
        {"vmin": [0, -1]},
        {"vmax": [2**9 - 1, 2**11 - 1]},
        {"noise_exp": [3, 4], "enable_noise": [1, 1]},
    ],
)
def test_blocks_with_different_settings_of_the_core_stay_apart(
    settings: dict[str, list[int]],
) -> None:
    pair = [busy(2, k, **{name: v[k] for name, v in settings.items()}) for k in range(2)]
    assert packed(Parts(pair).image(), small_chip()).n_cores == 2


def test_noise_settings_do_not_matter_where_there_is_no_noise() -> None:
    pair = [busy(2, k, noise_exp=3 + k, enable_noise=k) for k in range(2)]
    assert packed(Parts(pair).image(), small_chip()).n_cores == 1


def test_synapses_that_learn_stay_apart_from_others() -> None:
    learning = (1, 0, 0, 2, 8, 1, 1)
    groups = [Group([[64]], block=0), Group([[64]], block=1, learning=learning)]
    image = Parts([Block(1, core=0), Block(1, core=1), Block(1, core=2)], groups).image()
    after = Pack().apply(image, context())
    assert after.blocks.core[0] != after.blocks.core[1]
    assert after.n_cores == 2


def test_blocks_that_exchange_messages_share_a_core() -> None:
    groups = [Group([[64]] * 2, block=2), Group([[64]] * 2, block=3)]
    routes = [Route([0, 1], block=0, group=0), Route([0, 1], block=1, group=1)]
    image = Parts([busy(2, k) for k in range(4)], groups, routes=routes).image()
    core = packed(image, small_chip(compartments=4)).blocks.core
    assert core[0] == core[2] != core[1] == core[3]


def test_blocks_are_cut_where_that_saves_a_core() -> None:
    image, chip = blocks(6, 6, 6), small_chip(compartments=9)
    assert packed(image, chip, effort=1).n_cores == 3
    after = packed(image, chip, effort=3)
    assert after.n_cores == 2
    assert sorted(np.diff(after.blocks.start).tolist()) == [3, 3, 6, 6]


def test_equal_pieces_are_packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def count(problem: Problem, effort: int) -> Bins:
        asked.append(len(problem.loads))
        return pack(problem, effort)

    monkeypatch.setattr("spikeport.compile.passes.pack.pack", count)
    # Two blocks leave too little room for another on a core; half a core holds a block uncut.
    image, chip = blocks(*[4] * 8), small_chip(compartments=11)
    assert packed(image, chip, effort=2).n_cores == 4
    assert asked == [8]
    assert packed(image, chip, effort=3).n_cores == 3
    assert asked == [8, 8, 16]


EFFORTS = [(1, True), (2, False), (2, True)]
HARD = (13, 14, 18, 12, 18, 21)
"""Sizes that almost fill two cores of 50, and that the simple rules spread over three."""


@pytest.mark.parametrize(("options", "n_cores"), [((0, False), 3), ((1, False), 2), ((0, True), 2)])
def test_effort_and_exactness_save_cores(options: tuple[int, bool], n_cores: int) -> None:
    effort, exact = options
    image, chip = blocks(*HARD), small_chip(compartments=50)
    assert packed(image, chip, effort=effort, exact=exact).n_cores == n_cores


def test_exact_packing_with_effort_packs_pieces_of_blocks_too() -> None:
    sizes, thresholds = (27, 20, 30, 6, 21), (4, 0, 4, 2, 2)
    parts = [
        busy(n, k, vth=2**16 + 64 * threshold)
        for k, (n, threshold) in enumerate(zip(sizes, thresholds, strict=True))
    ]
    image, chip = Parts(parts).image(), small_chip(compartments=37, threshold_profiles=2)
    found = [packed(image, chip, effort=n, exact=exact).n_cores for n, exact in EFFORTS]
    assert found == [4, 4, 3]


def test_pieces_are_packed_exactly_even_if_simple_rules_save_a_core(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def exactly(problem: Problem, bins: Bins) -> ExactPacking:
        asked.append(len(problem.loads))
        return pack_exactly(problem, bins)

    monkeypatch.setattr("spikeport.compile.passes.pack.pack_exactly", exactly)
    packed(blocks(6, 6, 6), small_chip(compartments=9), effort=3, exact=True)
    assert asked[0] == 3
    assert max(asked) > 3


def test_joined_pieces_fit_where_lists_that_are_cut_again_take_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    crowded_once = [{0}, {1}, set[int]()]
    kept = []
    join = spikeport.compile.passes.pack._join

    def joined(image: ChipImage, *cuts_and_cores: Any) -> ChipImage:
        kept.append(len(cuts_and_cores[2]))
        return join(image, *cuts_and_cores)

    monkeypatch.setattr("spikeport.compile.passes.pack._join", joined)
    monkeypatch.setattr(
        "spikeport.compile.passes.pack._crowded", lambda *_: crowded_once[len(kept) - 1]
    )
    assert packed(blocks(6, 6, 6), small_chip(compartments=9), effort=3).n_cores == 2
    # The cuts of blocks on a crowded core are kept, until no core is crowded.
    assert len(kept) == 3
    assert kept[0] == 0 < kept[1] < kept[2]


def test_exact_packing_notes_the_least_number_of_cores() -> None:
    notes: dict[str, Any] = {}
    Pack(effort=0, exact=True).apply(blocks(*HARD), context(small_chip(compartments=50), notes))
    assert notes["cores_at_least_uncut"] == 2


def test_without_ortools_exact_packing_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    with pytest.raises(MissingExtraError) as caught:
        Pack(exact=True, effort=0).apply(blocks(*HARD), context(small_chip(compartments=50)))
    assert str(caught.value) == (
        "pack{exact=true} needs the package ortools, which is absent; "
        "install it with: pip install 'spikeport[optimal]'"
    )


def test_a_block_too_large_for_any_core_gets_a_core_of_its_own() -> None:
    chip = small_chip(compartments=4)
    assert Pack().apply(blocks(5, 2, 2), context(chip)).n_cores == 2


def test_the_lower_bound_is_given_for_each_resource() -> None:
    image, chip = blocks(6, 6, 6), small_chip(compartments=9, threshold_profiles=1)
    assert lower_bound(block_loads(image, chip), capacity(chip)) == {
        "compartments": 2,
        "in_axons": 0,
        "out_axons": 0,
        "synapse_bits": 0,
        "compartment_profiles": 1,
        "threshold_profiles": 1,
        "synapse_profiles": 0,
        "apart": 3,
        "cores": 3,
    }
