"""The drawing of a chip's cores."""

from typing import Any

import pytest

from spikeport.compile.report.drawing import (
    ENERGY,
    FILL,
    GAP,
    SIDE,
    TILE_GAP,
    TIME,
    chips,
    estimate,
)

STEP = SIDE + GAP
TILE = 2 * STEP + TILE_GAP


def report_of(places: dict[str, Any], n: int, **more: Any) -> dict[str, Any]:
    """Return a report on n cores, of which core k holds k of 10 compartments."""
    return {
        "cores": [{"label": f"core {k}", "compartments": k, "in_axons": 5} for k in range(n)],
        "placed": [[f"block {k}"] for k in range(n)],
        "limits_of_a_core": {"compartments": 10, "in_axons": None},
        "places": places,
        "energy": None,
        "timing": None,
        **more,
    }


def test_four_cores_share_a_tile_and_the_drawing_is_cropped() -> None:
    places = {"chip": [0] * 5, "x": [2, 2, 2, 2, 3], "y": [1] * 5}
    (chip,) = chips(report_of(places, 5), "")
    corners = [(core.x, core.y) for core in chip.cores]
    assert corners == [(0, 0), (STEP, 0), (0, STEP), (STEP, STEP), (TILE, 0)]
    assert (chip.width, chip.height) == (TILE + SIDE, STEP + SIDE)


def test_tiles_with_more_cores_are_larger() -> None:
    places = {"chip": [0] * 10, "x": [0] * 8 + [1, 0], "y": [0] * 9 + [1]}
    (chip,) = chips(report_of(places, 10), "")
    corners = [(core.x, core.y) for core in chip.cores]
    assert corners[6:8] == [(0, 2 * STEP), (STEP, 2 * STEP)]
    assert corners[8:] == [(TILE + STEP, 0), (0, TILE + STEP)]
    assert len(set(corners)) == 10


def test_every_chip_has_a_drawing_of_its_own() -> None:
    places = {"chip": [0, 0, 1], "x": [0, 0, 0], "y": [0, 0, 3]}
    first, second = chips(report_of(places, 3), "")
    assert [core.number for core in first.cores] == [0, 1]
    assert [(core.number, core.x, core.y) for core in second.cores] == [(2, 0, 0)]


def test_cores_are_in_rows_if_the_mesh_is_not_public() -> None:
    places = {"chip": [0] * 18, "x": None, "y": None}
    (chip,) = chips(report_of(places, 18), "")
    corners = [(core.x, core.y) for core in chip.cores]
    assert corners[15:] == [(15 * STEP, 0), (0, STEP), (STEP, STEP)]


def test_a_core_is_as_full_as_its_fullest_public_resource() -> None:
    (chip,) = chips(report_of({"chip": [0] * 3, "x": None, "y": None}, 3), "")
    fills = [core.measures[FILL] for core in chip.cores]
    assert [fill.share for fill in fills] == [0.0, 0.1, 0.2]
    assert fills[2].text == "20.0 % of compartments"
    assert list(chip.cores[0].measures) == [FILL]
    assert chip.cores[2].uses == (2, 5)
    assert chip.cores[2].blocks == ("block 2",)


def test_costs_are_shares_of_the_costliest_core() -> None:
    joule = {"low": 1e-9, "high": None, "unit": "J", "source": ""}
    joules = [None, joule | {"value": 1e-9}, joule | {"value": 4e-9}]
    seconds = {"value": 0.0, "low": 0.0, "high": 0.0, "unit": "s", "source": ""}
    report = report_of(
        {"chip": [0] * 3, "x": None, "y": None},
        3,
        energy={"bench": {"cores": [{"energy_step": one} for one in joules]}},
        timing={"bench": {"cores": [{"time_step": seconds}] * 3}, "other": None},
    )
    (chip,) = chips(report, "bench")
    assert [core.measures[ENERGY].share for core in chip.cores] == [0.0, 0.25, 1.0]
    assert chip.cores[0].measures[ENERGY].text == "no public figure"
    assert chip.cores[1].measures[ENERGY].text == "1 nJ [>= 1]"
    assert [core.measures[TIME].share for core in chip.cores] == [0.0] * 3


@pytest.mark.parametrize(("high", "text"), [(2e-6, "1 uJ [0.5, 2]"), (None, "1 uJ [>= 0.5]")])
def test_an_estimate_is_in_words_with_its_interval(high: float | None, text: str) -> None:
    value = {"value": 1e-6, "low": 5e-7, "high": high, "unit": "J", "source": "a paper"}
    assert estimate(value) == text
