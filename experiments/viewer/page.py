"""The page that plays a run in a browser: one file, or a page that follows a live run."""

import base64
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader

from spikeport.atomic import write_text
from spikeport.experiments.registry import imported
from spikeport.experiments.viewer.rows import POSES, Row, end_s, of_robot, rows

if TYPE_CHECKING:
    from spikeport.experiments.viewer.shapes import Shapes

FPS = 25
"""Poses per second in the page, which shows the latest one."""
ROUNDING = 1e-6
MM = 1000
"""Shapes are in whole millimetres, in 16 bits: 32 m to each side of the robot, and in height."""
MOST_MM = 2**15 - 1


def write_page(path: Path, probes: xr.Dataset, title: str) -> None:
    """Write the page of a run from its time series."""
    write_text(path, page(content(probes), title))


def page(data: str, title: str, live: bool = False) -> str:
    """Return the page of a run's content; a live one asks its server for more each second."""
    template = Environment(
        loader=PackageLoader("spikeport.experiments.viewer", "."), autoescape=True
    ).get_template("page.html.jinja")
    return template.render(title=title, data=data, live=live)


def content(probes: xr.Dataset) -> str:
    """Return the content of the page of a run, as JSON."""
    found = {"rows": [_row(row) for row in rows(probes)], "end_s": end_s(probes)}
    if of_robot(probes, POSES):
        frames = _frames(probes.time.values)
        # MuJoCo is installed where a robot ran; the run of a network alone does not need it.
        drawing = imported("view", "spikeport.experiments.viewer.shapes")
        shapes = drawing.shapes(probes[POSES].values[frames])
        found["robot"] = _robot(shapes, probes.time.values[frames])
    # A script ends at the first "</": a label of the user's could hold one.
    return json.dumps(found, separators=(",", ":")).replace("<", "\\u003c")


def _frames(times_s: np.ndarray) -> np.ndarray:
    """Return the indices of the poses that a screen shows: the first of each 1 / FPS s."""
    # In real time, a robot's steps differ in length, and a held state occurs twice.
    number = np.floor((times_s - times_s[:1]) * FPS + ROUNDING)
    return np.flatnonzero(np.diff(number, prepend=-1.0) > 0)


def _row(row: Row) -> dict[str, Any]:
    return {
        "name": row.name,
        "unit": row.unit,
        "spikes": row.values.ndim == 1,
        "labels": row.labels,
        "times": _floats(row.times_s),
        "values": _floats(row.values.T),
        "low": _finite(row.values, np.min),
        "high": _finite(row.values, np.max),
    }


def _finite(values: np.ndarray, end: Callable[[np.ndarray], float]) -> float:
    finite = values[np.isfinite(values)]
    return float(end(finite)) if finite.size else 0.0


def _robot(drawn: "Shapes", times_s: np.ndarray) -> dict[str, Any]:
    # Heights count from the level of the start, also where the floor rises or falls; in the plane,
    # shapes count from the robot, wherever it went.
    places_m = drawn.ends_m.mean(axis=(1, 2)) * (1, 1, 0)
    ends = (drawn.ends_m - places_m[:, np.newaxis, np.newaxis]) * MM
    return {
        "times": _floats(times_s),
        "places": _floats(places_m[:, :2] * MM),
        # A robot that climbs higher stays there, out of the picture.
        "ends": base64.b64encode(
            ends.clip(-MOST_MM, MOST_MM).round().astype("<i2").tobytes()
        ).decode(),
        "radii": _listed(drawn.radii_m),
        "colours": drawn.colours,
    }


def _floats(values: np.ndarray) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def _listed(values: np.ndarray) -> Sequence[float]:
    return [round(float(value), 4) for value in values]
