"""Findings of traps in images and their placements."""

import pytest

from spikeport.backends.board.nxsdk.findings import findings, host_axons, spikes_read
from spikeport.backends.board.nxsdk.model import Placement
from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.passes.base import Context
from spikeport.compile.passes.merge_axons import MergeAxons
from spikeport.hardware_models import chip
from tests.helpers.images import Block, Group, Output, Parts, Route
from tests.helpers.writable import writable

LEARNED = (1, 1, -7, 10, 2.5, 2, 4)


def found(image: ChipImage) -> dict[str, list[str]]:
    """Return ids of findings of the packed and of the single placement."""
    placements = Placement.packed(image), Placement.single(image)
    return {p.name: [one.trap.id for one in findings(image, p)] for p in placements}


def test_a_plain_image_has_no_findings() -> None:
    image = writable(Parts([Block(2), Block(1, core=1)], [Group([[64]])]).image())
    assert found(image) == {"packed": [], "one block a core": []}


CASES: list[tuple[str, Parts, list[str], list[str]]] = [
    ("thresholds", Parts([Block(1, vth=64 * (i + 1)) for i in range(8)]), ["NX01"], []),
    (
        "compartment profiles",
        Parts([Block(1, refract_delay=i + 1) for i in range(32)]),
        ["NX15"],
        [],
    ),
    ("31 profiles", Parts([Block(1, refract_delay=i + 1) for i in range(31)]), [], []),
    ("seven thresholds", Parts([Block(1, vth=64 * (i + 1)) for i in range(7)]), [], []),
    (
        "noise that differs",
        Parts([Block(1, enable_noise=1), Block(1, enable_noise=1, noise_exp=8)]),
        ["NX02", "NX11"],
        ["NX11"],
    ),
    ("noise that is off", Parts([Block(1), Block(1, noise_exp=8)]), [], []),
    ("voltage ranges", Parts([Block(1), Block(1, vmin=-1)]), ["NX03"], []),
    (
        "population axons",
        Parts([Block(1), Block(1)], [Group([[64]], pop_type=32)], routes=[Route([0], block=1)]),
        ["NX04"],
        [],
    ),
    (
        "a learning group beside another",
        Parts([Block(2)], [Group([[64]], learning=LEARNED), Group([[64]], learning=LEARNED)]),
        ["NX05"],
        ["NX05"],
    ),
    (
        "a learning core with two blocks",
        Parts([Block(2), Block(1)], [Group([[64]], learning=LEARNED)]),
        ["NX05"],
        [],
    ),
    (
        "an unused axon at the end",
        Parts([Block(2)], [Group([[64]], axon_row=[0, 0], axon_base=[0, -1]), Group([[64]])]),
        ["NX06"],
        ["NX06"],
    ),
    (
        "an empty row at the end",
        Parts([Block(2)], [Group([[64], []]), Group([[64]])]),
        ["NX06"],
        ["NX06"],
    ),
    ("a far base", Parts([Block(300)], [Group([[64]], axon_base=[257])]), ["NX07"], ["NX07"]),
    (
        "many inputs",
        Parts([Block(1)], [Group([[64]])], [51], [Route([0] * 51, input=0)]),
        ["NX08"],
        ["NX08"],
    ),
    (
        "spikes that are read",
        Parts([Block(2, vth=[64, 128])], outputs=[Output("spiked", [0, 1])]),
        ["NX09", "NX14"],
        ["NX09", "NX14"],
    ),
    (
        "refractory delays",
        Parts([Block(2, vth=64, refract_delay=[1, 2])], outputs=[Output("spiked", [0])]),
        ["NX13", "NX14"],
        ["NX13", "NX14"],
    ),
    (
        "refractory delays that nobody reads",
        Parts([Block(2, refract_delay=[1, 2])], outputs=[Output("voltage", [0])]),
        ["NX14"],
        ["NX14"],
    ),
    (
        "targets that move",
        Parts([Block(1), Block(1)], [Group([[64]], block=1)]),
        ["NX10"],
        [],
    ),
]


@pytest.mark.parametrize(
    ("parts", "packed", "single"), [case[1:] for case in CASES], ids=[case[0] for case in CASES]
)
def test_traps_are_found_in_the_placements_that_have_them(
    parts: Parts, packed: list[str], single: list[str]
) -> None:
    assert found(parts.image()) == {"packed": packed, "one block a core": single}


def test_a_row_of_scattered_targets_in_a_format_without_targets_is_found() -> None:
    image = Parts([Block(3)], [Group([[64, 64]], indices=[[[0, 2]]])]).image()
    form = image.groups.format.copy()
    form[:, image.manifest.synapse_format.index("compression")] = 3
    arrays = {**image.arrays, "synapse_format": form}
    (only,) = findings(ChipImage.from_arrays(image.manifest, arrays), Placement.single(image))
    assert (only.trap.id, only.used) == (
        "NX12",
        "1 of 1 weight rows, whose targets are not consecutive from 0",
    )


def test_merging_axons_cures_groups_that_end_in_an_unused_axon_or_an_empty_row() -> None:
    groups = [Group([[64], [128]], axon_row=[0, 1, 0], axon_base=[0, 1, -1]), Group([[64], []])]
    routes = [Route([0, 1, 2], group=0, input=0), Route([0, 1, 0], group=1, input=0)]
    image = Parts([Block(2), Block(1)], [*groups, Group([[64]], block=1)], [3], routes).image()
    (found,) = (one for one in findings(image, Placement.single(image)) if one.trap.refused)
    assert found.trap.id == "NX06"
    context = Context(chip.get("loihi"), 0.001, lambda *_note: None)
    merged = MergeAxons().apply(image, context)
    assert [one for one in findings(merged, Placement.single(merged)) if one.trap.refused] == []


@pytest.mark.parametrize(
    ("key", "value"), [("voltage", "a voltage of -1"), ("spiked", "32 spikes at once")]
)
def test_an_output_that_can_end_a_step_like_a_shutdown_is_named(key: str, value: str) -> None:
    image = Parts([Block(2)], outputs=[Output("current", [0]), Output(key, [1])]).image()
    *_, found = findings(image, Placement.single(image))
    assert found.trap.id == "NX14"
    rest = "or -1 in the unused rest of the last packet, which the chip's snip never sets"
    assert found.used == f"{value}, {rest}"


def test_a_finding_names_its_core_and_the_count() -> None:
    image = CASES[0][1].image()
    (one,) = findings(image, Placement.packed(image))
    assert (one.where, one.used) == ("core 0", "8, nengo-loihi's builder takes up to 7")


def test_axons_of_the_host_and_spikes_that_are_read_are_counted() -> None:
    routes = [Route([0, -1, 0], input=0), Route([0, 0, -1], input=0), Route([0], block=0)]
    outputs = [Output("voltage", [0]), Output("spiked", [0, 0])]
    image = Parts([Block(1)], [Group([[64]])], [3], routes, outputs).image()
    assert host_axons(image) == 4
    assert spikes_read(image).tolist() == [0]
    assert spikes_read(Parts().image()).tolist() == []
