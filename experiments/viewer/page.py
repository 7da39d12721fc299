"""The page of a run: one file, which plays it in a browser without a network."""

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader

from spikeport.atomic import write_text
from spikeport.experiments.viewer.rows import POSES, Row, rows
from spikeport.experiments.viewer.shapes import Shapes, shapes

FPS = 25
"""Poses a second that the page has; it shows the latest."""
MM = 1000
"""Places are whole millimetres, in 16 bits: 32 m to each side of where the run began."""


def write_page(path: Path, probes: xr.Dataset, title: str) -> None:
    """Write the page of a run from its time series."""
    content = {"rows": [_row(row) for row in rows(probes)], "end_s": _end_s(probes)}
    if POSES in probes:
        # A screen shows no more poses than these.
        step = max(1, round(1 / (FPS * _step_s(probes))))
        times_s = probes.time.values[::step]
        content["robot"] = _robot(shapes(probes[POSES].values[::step]), times_s)
    template = Environment(
        loader=PackageLoader("spikeport.experiments.viewer", "."), autoescape=True
    ).get_template("page.html.jinja")
    # A script ends at the first "</": a label of the user's could hold one.
    data = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
    write_text(path, template.render(title=title, data=data))


def _step_s(probes: xr.Dataset) -> float:
    times_s = probes.time.values
    return float(times_s[1] - times_s[0]) if len(times_s) > 1 else 1.0


def _end_s(probes: xr.Dataset) -> float:
    ends = [float(probes[name].max()) for name in ("time", "step") if probes.sizes.get(name)]
    return max(ends, default=0.0)


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


def _finite(values: np.ndarray, end: Any) -> float:
    finite = values[np.isfinite(values)]
    return float(end(finite)) if finite.size else 0.0


def _robot(drawn: Shapes, times_s: np.ndarray) -> dict[str, Any]:
    # Heights count from the floor; places in the plane from the start, to fit into 16 bits.
    start_m = drawn.ends_m[0].mean(axis=(0, 1)) * (1, 1, 0)
    places = np.clip((drawn.ends_m - start_m) * MM, -(2**15), 2**15 - 1).round().astype("<i2")
    return {
        "times": _floats(times_s),
        "ends": base64.b64encode(places.tobytes()).decode(),
        "radii": _listed(drawn.radii_m),
        "colours": drawn.colours,
    }


def _floats(values: np.ndarray) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()


def _listed(values: np.ndarray) -> Sequence[float]:
    return [round(float(value), 4) for value in values]
