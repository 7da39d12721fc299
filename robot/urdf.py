"""Figures of the H1 in Unitree's URDF that differ from those of h1.xml."""

from functools import cache
from pathlib import Path
from typing import Any

from spikeport.files import read_toml
from spikeport.robot.description import JOINTS

_PATH = Path(__file__).with_name("h1_urdf.toml")


@cache
def figures() -> dict[str, Any]:
    """Return the links, by name, and the ranges of joints, by role."""
    return read_toml(_PATH)


def ranges_rad() -> dict[str, tuple[float, float]]:
    """Return the range of each joint whose range differs from that in h1.xml."""
    return {
        # A range holds for both sides: the URDF's are symmetric.
        joint: (low, high)
        for role, (low, high) in figures()["ranges"].items()
        for joint in JOINTS
        if joint.endswith(role)
    }
