"""The record of a switching run, and its time series with names and units."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from spikeport.constants import DT_S
from spikeport.experiments.arm.recording import ArmRecording
from spikeport.experiments.spikes import ragged
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.walk.paths import WalkPath
from spikeport.experiments.walk.recording import WalkRecording, coordinates, series
from spikeport.networks.arm import AXES
from spikeport.networks.humanoid import ACTIONS
from spikeport.robot.description import ARM_JOINTS
from spikeport.robot.terrain import LEVEL, Floor
from spikeport.simulator import Simulator


class SwitchRun(NamedTuple):
    """A switching run that is over.

    Attributes
    ----------
    goals : sequence of Goal
        The goals of all phases.
    paths : list of WalkPath or None
        The path of each phase that began, at its place in the world; None where the arm worked.
    recording, arm : WalkRecording, ArmRecording
        Legs and arm at all physics steps.
    local_m : (n, 3) array
        The hand in the frame of its task, the sheet's or the torso's, in m.
    hands_m : (n, 3) array
        The hand's place in the world, in m.
    gates : (n_steps, n_actions) array
        1 for the action that is selected.
    spikes : dict of str to (n_steps, n_neurons) array
        Spikes of each nucleus, action by action; empty without neurons.
    fallen_at_s : float or None
        The time at which the robot fell.
    anchored : bool
        True if the pelvis was held while the arm worked.
    sim : Simulator
        The simulator that ran.
    wall_s : float
        Wall-clock time of the run.
    floor : Floor
        The floor under the robot.
    """

    goals: Sequence[Goal]
    paths: list[WalkPath | None]
    recording: WalkRecording
    arm: ArmRecording
    local_m: np.ndarray
    hands_m: np.ndarray
    gates: np.ndarray
    spikes: dict[str, np.ndarray]
    fallen_at_s: float | None
    anchored: bool
    sim: Simulator
    wall_s: float
    floor: Floor = LEVEL


def dataset(run: SwitchRun) -> xr.Dataset:
    """Return the series at every physics step, gates and spikes at every controller's step."""
    of_arm = {
        "torque": ("arm_joint", run.arm.torque, "N m", "torque of the arm's controller"),
        "hand": ("axis", run.arm.hand, "m", "right hand, in the torso's frame"),
        "target": ("axis", run.arm.target, "m", "target of the right hand, in the torso's frame"),
        "hand_in_task": ("axis", run.local_m, "m", "right hand, in the sheet's or torso's frame"),
        "hand_in_world": ("axis", run.hands_m, "m", "right hand, in the world"),
    }
    data = {
        name: (("time", along), values, {"units": unit, "long_name": text})
        for name, (along, values, unit, text) in of_arm.items()
    }
    steps = {"units": "s", "long_name": "end of a step of the controller"}
    named = {
        **coordinates(run.recording),
        "arm_joint": list(ARM_JOINTS),
        "axis": list(AXES),
        "step": ("step", (1 + np.arange(len(run.gates))) * DT_S, steps),
        "selectable": list(ACTIONS),
    }
    gates = ("step", "selectable"), run.gates, {"long_name": "1 for the action that is selected"}
    spikes = ragged(run.spikes)
    return xr.Dataset({**series(run.recording), **data, "gates": gates, **spikes}, named)
