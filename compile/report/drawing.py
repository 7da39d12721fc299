"""The drawing of a chip: its cores in their places, with their content and costs."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from spikeport.compile.report.report import Json
from spikeport.hardware_models.estimate import Estimate

SIDE, GAP, TILE_GAP = 44, 3, 10
"""The size of a core, the gaps between cores and between tiles, in pixels."""
PER_ROW = 16
"""Cores in a row of a chip whose mesh is not public."""
TILE_SIDE = 2
"""The fewest cores along the side of a tile: Loihi has four cores to a tile."""
FILL, ENERGY, TIME = "fill", "energy", "step time"


class Measure(NamedTuple):
    """A figure of a core: in words, as a number, and as a share of its limit or of the largest."""

    text: str
    value: float
    share: float


class Core(NamedTuple):
    """A core: its place, what it holds, its use of every resource, and its measures by name."""

    number: int
    x: int
    y: int
    label: str
    blocks: tuple[str, ...]
    uses: tuple[int, ...]
    measures: Mapping[str, Measure]


class Chip(NamedTuple):
    """A chip that is in use: the size of its drawing, cropped to its cores, and these cores."""

    number: int
    width: int
    height: int
    cores: tuple[Core, ...]


def estimate(value: Mapping[str, object] | None) -> str:
    """Return an estimate, which is passed as plain data, in words with its interval."""
    return "no public figure" if value is None else Estimate(**value).format()  # type: ignore[arg-type]


def chips(report: Json, calibration: str) -> list[Chip]:
    """Return the drawings of the chips in use, with energy and time in one calibration."""
    measures = _measures(report, calibration)
    found = []
    for chip in sorted(set(report["places"]["chip"])):
        mine = [n for n, on in enumerate(report["places"]["chip"]) if on == chip]
        corners = _corners(report["places"], mine)
        left, top = min(x for x, _ in corners), min(y for _, y in corners)
        cores = tuple(
            _core(report, number, (x - left, y - top), measures)
            for number, (x, y) in zip(mine, corners, strict=True)
        )
        width, height = (SIDE + max(getattr(core, axis) for core in cores) for axis in "xy")
        found.append(Chip(chip, width, height, cores))
    return found


def _core(
    report: Json, number: int, corner: tuple[int, int], measures: Mapping[str, Sequence[Measure]]
) -> Core:
    row = report["cores"][number]
    return Core(
        number,
        *corner,
        row["label"],
        tuple(report["placed"][number]),
        tuple(row[name] for name in report["limits_of_a_core"]),
        {name: of_cores[number] for name, of_cores in measures.items()},
    )


def _corners(places: Json, cores: Sequence[int]) -> list[tuple[int, int]]:
    """Return the corner of each core of a chip: in the square of its tile, or in rows if the mesh
    is not public.
    """
    step = SIDE + GAP
    if places["x"] is None:
        return [(i % PER_ROW * step, i // PER_ROW * step) for i in range(len(cores))]
    tiles = [(places["x"][core], places["y"][core]) for core in cores]
    side = max(TILE_SIDE, math.ceil(math.sqrt(max(Counter(tiles).values()))))
    tile = side * step + TILE_GAP
    taken: Counter[tuple[int, int]] = Counter()
    corners = []
    for x, y in tiles:
        # Cores of a tile fill its places in the order of their numbers.
        slot = taken[x, y]
        taken[x, y] += 1
        corners.append((x * tile + slot % side * step, y * tile + slot // side * step))
    return corners


def _measures(report: Json, calibration: str) -> dict[str, list[Measure]]:
    """Return the measures that the report has figures for, each by core."""
    found = {FILL: [_fill(row, report["limits_of_a_core"]) for row in report["cores"]]}
    for name, section, key in ((ENERGY, "energy", "energy_step"), (TIME, "timing", "time_step")):
        costs = (report[section] or {}).get(calibration)
        if costs is not None:
            found[name] = _against_most([core[key] for core in costs["cores"]])
    return found


def _fill(row: Json, limits: Mapping[str, int | None]) -> Measure:
    """Return the share of a core's fullest resource that is in use."""
    shares = {name: row[name] / most for name, most in limits.items() if most}
    if not shares:
        return Measure("no limit is public", 0.0, 0.0)
    fullest = max(shares, key=lambda name: shares[name])
    text = f"{100 * shares[fullest]:.1f} % of {fullest.replace('_', ' ')}"
    return Measure(text, shares[fullest], min(shares[fullest], 1.0))


def _against_most(estimates: Sequence[Mapping[str, object] | None]) -> list[Measure]:
    values = [0.0 if one is None else float(str(one["value"])) for one in estimates]
    most = max(values) or 1.0
    return [
        Measure(estimate(one), value, value / most)
        for one, value in zip(estimates, values, strict=True)
    ]
