"""The reference strokes of the ten digits: smooth curves in a unit box.

A stroke's points are joined by a cubic spline over the square roots of their distances (centripetal
parameters), which makes no loops between near points. The points are data (``strokes.toml``); x
runs from left to right and y from bottom to top.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from spikeport.files import read_toml

DIGITS = tuple(range(10))
POINTS = 4000
"""Points of a sampled stroke: 0.2 mm apart in the longest digit at its usual size."""


@cache
def _strokes() -> dict[str, dict[str, Any]]:
    return read_toml(Path(__file__).with_name("strokes.toml"))


def unit_stroke(digit: int) -> np.ndarray:
    """Return points (n, 2) of a digit in the unit box, in the order they are drawn."""
    stroke = _strokes()[str(digit)]
    points, closed = np.array(stroke["points"]), stroke.get("closed", False)
    if closed:
        points = np.vstack([points, points[:1]])
    chords = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    knots = np.concatenate([[0.0], np.cumsum(chords)])
    spline = CubicSpline(knots, points, bc_type="periodic" if closed else "natural")
    return np.asarray(spline(np.linspace(0.0, knots[-1], POINTS)))
