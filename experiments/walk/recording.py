"""The record of a walking run, with names and units, and when a robot has fallen."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from spikeport.experiments.recording import Recording
from spikeport.experiments.spikes import ragged
from spikeport.experiments.walk.paths import WalkPath
from spikeport.networks.region import Box
from spikeport.robot.description import JOINTS
from spikeport.robot.feet import SIDES
from spikeport.robot.terrain import LEVEL, Floor
from spikeport.robot.walk_interface import LOWEST_PELVIS_M, PARTS, SMALLEST_UPRIGHT, gravity
from spikeport.simulator import Simulator

ROUNDING = 1e-6
"""The rounding error of a time, as a share of its unit."""
SERIES = {
    "observation": ("observed", "see `part`", "observation of the policy, before it is clipped"),
    "reference": ("moving", "m, m/s", "place and velocity to take, from the start"),
    "state": ("turned", "rad, m, m/s", "heading, place and velocity of the pelvis"),
    "action": ("joint", "1", "action of the policy"),
    "command": ("commanded", "m/s, rad/s", "forward speed and yaw rate as obeyed, after `law`"),
    "on_floor": ("foot", "1", "whether a foot touches the floor"),
}
MOVING = ["x", "y", "vx", "vy"]
"""Coordinates of a place and a velocity in the plane."""


def fallen(height_m: float, upright: float) -> bool:
    """Return whether the pelvis is below 0.7 m or tilted by more than 45 degrees.

    ``upright`` is the upward component of the pelvis' own vertical axis, cos(tilt).
    """
    return height_m < LOWEST_PELVIS_M or upright < SMALLEST_UPRIGHT


@dataclass(frozen=True)
class WalkRecording(Recording):
    """A walking robot at every physics step.

    Attributes
    ----------
    observation : (n, 69) array
        The policy's last observation, before it is clipped.
    reference : (n, 4) array
        Position in m and velocity in m/s to take, world frame.
    state : (n, 5) array
        Heading in rad, position in m and velocity in m/s, world frame.
    action : (n, 19) array
        The policy's action.
    command : (n, 2) array
        Forward speed in m/s and yaw rate in rad/s as obeyed, after `law`.
    height_m : (n,) array
        Height of the pelvis.
    on_floor : (n, 2) array of bool
        True if the left and the right foot touch the floor.
    quaternion : (n, 4) array
        Orientation of the pelvis (w, x, y, z) at the policy's last observation, without noise and
        delay.
    turning_rad_s : (n, 3) array
        Angular velocity of the pelvis at that time, in its own frame.
    """

    observation: np.ndarray
    reference: np.ndarray
    state: np.ndarray
    action: np.ndarray
    command: np.ndarray
    height_m: np.ndarray
    on_floor: np.ndarray
    quaternion: np.ndarray
    turning_rad_s: np.ndarray

    @property
    def position_m(self) -> np.ndarray:
        """Place of the robot, (n, 2) in m."""
        return self.state[:, 1:3]

    @property
    def walked_m(self) -> float:
        """Length of the way in m, to the end, by half seconds: sway within them does not count."""
        half_s = np.floor(2 * self.time_s + ROUNDING)
        # The first place of each half second, and the last place of the run.
        begins = np.flatnonzero(np.diff(half_s, prepend=-1))
        kept = self.position_m[np.append(begins, len(half_s) - 1)]
        return float(np.linalg.norm(np.diff(kept, axis=0), axis=1).sum())

    @property
    def speed_m_s(self) -> np.ndarray:
        """Speed along the heading, (n,) in m/s."""
        heading, velocity = self.state[:, 0], self.state[:, 3:]
        ahead = np.cos(heading) * velocity[:, 0] + np.sin(heading) * velocity[:, 1]
        return np.asarray(ahead)

    @property
    def down(self) -> np.ndarray:
        """Direction of gravity in the pelvis frame, (n, 3)."""
        # By rows: einsum adds up in another order where columns are contiguous.
        return np.ascontiguousarray(gravity(self.quaternion))

    @property
    def yaw_rate_rad_s(self) -> np.ndarray:
        """Angular velocity about the vertical, -g . omega, (n,) in rad/s."""
        return np.asarray(-np.einsum("nd,nd->n", self.down, self.turning_rad_s))


class WalkRun(NamedTuple):
    """A walking run that is over.

    Attributes
    ----------
    path : WalkPath
        The path to walk.
    seconds : float
        Simulated time that was asked for.
    recording : WalkRecording
        The recording of all physics steps.
    fallen_at_s : float or None
        The time at which the robot fell.
    encoding : Box or None
        Range of the observations that the policy represents; None where it is exact.
    sim : Simulator
        The simulator that ran.
    wall_s : float
        Wall-clock time of the run.
    spikes : (n_steps, n) array or None
        Spikes of some neurons of the policy; None where none are kept.
    floor : Floor
        The floor under the robot.
    """

    path: WalkPath
    seconds: float
    recording: WalkRecording
    fallen_at_s: float | None
    encoding: Box | None
    sim: Simulator
    wall_s: float
    spikes: np.ndarray | None = None
    floor: Floor = LEVEL


def dataset(run: WalkRun) -> xr.Dataset:
    """Return the series at every physics step, and spikes, if any, one by one."""
    spikes = {} if run.spikes is None else ragged({"policy": run.spikes})
    return xr.Dataset({**series(run.recording), **spikes}, coordinates(run.recording))


def series(recording: WalkRecording) -> dict[str, Any]:
    """Return the variables of a dataset at every physics step."""
    data = {
        name: (("time", dimension), getattr(recording, name), {"units": unit, "long_name": text})
        for name, (dimension, unit, text) in SERIES.items()
    }
    text = "height of the pelvis above the floor"
    return {**data, "height": ("time", recording.height_m, {"units": "m", "long_name": text})}


def coordinates(recording: WalkRecording) -> dict[str, Any]:
    """Return the coordinates of `series`."""
    parts = [name for name, place in PARTS.items() for _ in range(place.start, place.stop)]
    return {
        "time": ("time", recording.time_s, {"units": "s"}),
        "part": ("observed", parts),
        "moving": MOVING,
        "turned": ["heading", *MOVING],
        "joint": list(JOINTS),
        "commanded": ["speed", "yaw rate"],
        "foot": list(SIDES),
    }
