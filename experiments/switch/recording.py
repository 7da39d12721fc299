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
from spikeport.experiments.walk.recording import MOVING, WalkRecording
from spikeport.networks.arm import AXES
from spikeport.networks.humanoid import ACTIONS
from spikeport.robot.description import ARM_JOINTS, JOINTS
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


def dataset(run: SwitchRun) -> xr.Dataset:
    """Return the series at every physics step, gates and spikes at every controller's step."""
    walk, arm, turned = run.recording, run.arm, ["heading", *MOVING]
    series = {
        "reference": (MOVING, "moving", walk.reference, "m, m/s", "place and velocity to take"),
        "state": (turned, "turned", walk.state, "rad, m, m/s", "heading, place and velocity"),
        "action": (JOINTS, "joint", walk.action, "1", "action of the policy"),
        "command": (
            ["speed", "yaw rate"],
            "commanded",
            walk.command,
            "m/s, rad/s",
            "command of the follower",
        ),
        "torque": (ARM_JOINTS, "arm_joint", arm.torque, "N m", "torque of the arm's controller"),
        "hand": (AXES, "axis", arm.hand, "m", "right hand, in the torso's frame"),
        "target": (AXES, "axis", arm.target, "m", "target of the right hand, in the torso's frame"),
    }
    data = {
        name: (("time", along), values, {"units": unit, "long_name": text})
        for name, (_, along, values, unit, text) in series.items()
    }
    named = {along: list(labels) for labels, along, *_ in series.values()}
    steps = {"units": "s", "long_name": "end of a step of the controller"}
    coordinates = {
        **named,
        "time": ("time", walk.time_s, {"units": "s"}),
        "step": ("step", (1 + np.arange(len(run.gates))) * DT_S, steps),
        "selectable": list(ACTIONS),
    }
    gates = ("step", "selectable"), run.gates, {"long_name": "1 for the action that is selected"}
    return xr.Dataset({**data, "gates": gates, **ragged(run.spikes)}, coordinates)
