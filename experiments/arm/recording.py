"""The record of a run of the arm, and its time series with names and units."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import xarray as xr

from spikeport.experiments.recording import Recording
from spikeport.experiments.spikes import ragged
from spikeport.networks.arm import AXES
from spikeport.networks.operational_space import OperationalSpaceLaw
from spikeport.robot.description import ARM_JOINTS
from spikeport.simulator import Simulator

SERIES = {
    "q": ("joint", "rad", "joint angle"),
    "dq": ("joint", "rad/s", "joint velocity"),
    "hand": ("axis", "m", "position of the right hand, world frame"),
    "target": ("axis", "m", "position to reach, world frame"),
    "torque": ("joint", "N m", "torque of the controller"),
    "exact_torque": ("joint", "N m", "torque of the exact law at the same state"),
}


class ArmTask(Protocol):
    """A task of the arm: a target (3,) in m that moves."""

    target: np.ndarray

    def update(self, time_s: float, hand: np.ndarray) -> None:
        """Move the target on if it is time to, or if the hand (3,) in m has reached it."""


@dataclass(frozen=True)
class ArmRecording(Recording):
    """A record of an arm's controller at every physics step.

    Attributes
    ----------
    q, dq : (n, 4) array
        Joint angles in rad, and velocities in rad/s.
    hand, target : (n, 3) array
        The hand's place and its target, in m.
    torque : (n, 4) array
        The controller's torques, in N m.
    """

    q: np.ndarray
    dq: np.ndarray
    hand: np.ndarray
    target: np.ndarray
    torque: np.ndarray

    @property
    def distance_m(self) -> np.ndarray:
        """Distance of hand and target, (n,)."""
        return np.asarray(np.linalg.norm(self.target - self.hand, axis=1))

    def at_limit(self, limits_rad: np.ndarray) -> np.ndarray:
        """Return whether a joint is at or beyond one of its limits (4, 2) in rad, (n,) of bool."""
        at_limit = (self.q <= limits_rad[:, 0]) | (self.q >= limits_rad[:, 1])
        return np.asarray(at_limit.any(axis=1))

    def exact_torque(self, law: OperationalSpaceLaw) -> np.ndarray:
        """Return (n, 4) torques of the exact law at the recorded states, in N m."""
        return law.torques(self.q, self.dq, self.target - self.hand)


class ArmRun(NamedTuple):
    """A run of the arm that is over.

    Attributes
    ----------
    recording : ArmRecording
        The recording of all physics steps.
    task : ArmTask or None
        The task of the arm.
    exact : (n, 4) array
        Torques of the exact law at the recorded states, in N m.
    at_limit : (n,) array of bool
        True if a joint was at its lowest or highest angle.
    rasters : dict of str to (n_steps, n_neurons) array
        Spikes of some M1 neurons, by axis; empty without neurons.
    sim : Simulator
        The simulator that ran.
    wall_s : float
        Wall-clock time of the run.
    """

    recording: ArmRecording
    task: ArmTask | None
    exact: np.ndarray
    at_limit: np.ndarray
    rasters: dict[str, np.ndarray]
    sim: Simulator
    wall_s: float


def dataset(run: ArmRun) -> xr.Dataset:
    """Return the series at every physics step, and the spikes of M1 one by one."""
    recording = run.recording
    data = {
        name: (
            ("time", dimension),
            run.exact if name == "exact_torque" else getattr(recording, name),
            {"units": unit, "long_name": text},
        )
        for name, (dimension, unit, text) in SERIES.items()
    }
    coordinates = {
        "time": ("time", recording.time_s, {"units": "s"}),
        "joint": list(ARM_JOINTS),
        "axis": list(AXES),
    }
    spikes = ragged({f"M1_{axis}": raster for axis, raster in run.rasters.items()})
    return xr.Dataset({**data, **spikes}, coordinates)
