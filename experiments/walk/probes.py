"""``probes.nc``: the time series of a walking run, with names and units."""

from pathlib import Path

import numpy as np
import xarray as xr

from spikeport.atomic import atomic_path
from spikeport.experiments.closed_loop import DT_S
from spikeport.experiments.walk.recording import Recording
from spikeport.robot.description import JOINTS
from spikeport.robot.feet import SIDES
from spikeport.robot.walk_interface import PARTS

SERIES = {
    "observation": ("observed", "see `part`", "what the policy is told, before it is clipped"),
    "reference": ("moving", "m, m/s", "place and velocity to take, from the start"),
    "state": ("turned", "rad, m, m/s", "heading, place and velocity of the pelvis"),
    "action": ("joint", "1", "action of the policy"),
    "command": ("commanded", "m/s, rad/s", "forward speed and yaw rate of the path follower"),
    "on_floor": ("foot", "1", "whether a foot touches the floor"),
}
_MOVING = ["x", "y", "vx", "vy"]


def write_probes(folder: Path, recording: Recording, spikes: np.ndarray | None = None) -> None:
    """Write the series at every physics step, and spikes (n_steps, n), if any, one by one."""
    data = {
        name: (("time", dimension), getattr(recording, name), {"units": unit, "long_name": text})
        for name, (dimension, unit, text) in SERIES.items()
    }
    height = ("time", recording.height_m, {"units": "m", "long_name": "height of the pelvis"})
    parts = [name for name, place in PARTS.items() for _ in range(place.start, place.stop)]
    coordinates = {
        "time": ("time", recording.time_s, {"units": "s"}),
        "part": ("observed", parts),
        "moving": _MOVING,
        "turned": ["heading", *_MOVING],
        "joint": list(JOINTS),
        "commanded": ["speed", "yaw rate"],
        "foot": list(SIDES),
    }
    dataset = xr.Dataset({**data, "height": height, **_ragged(spikes)}, coordinates)
    with atomic_path(folder / "probes.nc") as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")


def _ragged(spikes: np.ndarray | None) -> dict[str, tuple]:
    """One entry per spike instead of a table of mostly zeros."""
    if spikes is None:
        return {}
    step, neuron = np.nonzero(spikes)
    return {
        "spike_time": ("spike", (step + 1) * DT_S, {"units": "s", "long_name": "spike"}),
        "spike_neuron": ("spike", neuron, {"long_name": "number of the policy's neuron"}),
    }
