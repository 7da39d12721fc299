"""``probes.nc``: the time series of a switching run, with names and units."""

from pathlib import Path

import numpy as np
import xarray as xr

from spikeport.atomic import atomic_path
from spikeport.experiments.switch.trial import SwitchRun
from spikeport.networks.arm import AXES
from spikeport.networks.humanoid import ACTIONS
from spikeport.robot.description import ARM_JOINTS, JOINTS

_MOVING = ["x", "y", "vx", "vy"]


def write_probes(folder: Path, run: SwitchRun, dt_s: float) -> None:
    """Write the series at every physics step, gates and spikes at every step of the controller."""
    walk, arm, turned = run.recording, run.arm, ["heading", *_MOVING]
    series = {
        "reference": (_MOVING, "moving", walk.reference, "m, m/s", "place and velocity to take"),
        "state": (turned, "turned", walk.state, "rad, m, m/s", "heading, place and velocity"),
        "action": (JOINTS, "joint", walk.action, "1", "action of the policy"),
        "command": (["speed", "yaw rate"], "commanded", walk.command, "m/s, rad/s", "follower's"),
        "torque": (ARM_JOINTS, "arm_joint", arm.torque, "N m", "torque of the arm's controller"),
        "hand": (AXES, "axis", arm.hand, "m", "right hand, as seen from the torso"),
        "target": (AXES, "axis", arm.target, "m", "where it is to be, as seen from the torso"),
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
        "step": ("step", (1 + np.arange(len(run.gates))) * dt_s, steps),
        "selectable": list(ACTIONS),
    }
    gates = ("step", "selectable"), run.gates, {"long_name": "1 for the action that is selected"}
    dataset = xr.Dataset({**data, "gates": gates, **_ragged(run.spikes, dt_s)}, coordinates)
    with atomic_path(folder / "probes.nc") as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")


def _ragged(spikes: dict[str, np.ndarray], dt_s: float) -> dict[str, tuple]:
    """One entry per spike of each nucleus, instead of a table of mostly zeros."""
    found: dict[str, tuple] = {}
    for name, raster in spikes.items():
        step, neuron = np.nonzero(raster)
        along = f"{name}_spike"
        found[f"{name}_time"] = along, (step + 1) * dt_s, {"units": "s"}
        found[f"{name}_neuron"] = along, neuron, {"long_name": "number, action by action"}
    return found
