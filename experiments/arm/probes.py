"""``probes.nc``: the time series of a run of the arm, with names and units."""

from pathlib import Path

import numpy as np
import xarray as xr

from spikeport.atomic import atomic_path
from spikeport.experiments.arm.loop import Recording
from spikeport.networks.arm import AXES
from spikeport.robot.description import ARM_JOINTS

SERIES = {
    "q": ("joint", "rad", "joint angle"),
    "dq": ("joint", "rad/s", "joint velocity"),
    "hand": ("axis", "m", "position of the right hand, world frame"),
    "target": ("axis", "m", "position to reach, world frame"),
    "torque": ("joint", "N m", "torque of the controller"),
    "exact_torque": ("joint", "N m", "torque of the exact law at the same state"),
}


def write_probes(
    folder: Path,
    recording: Recording,
    exact: np.ndarray,
    rasters: dict[str, np.ndarray],
    dt_s: float,
) -> None:
    """Write the series at every physics step, and the spikes of M1 one by one."""
    series = {**recording._asdict(), "exact_torque": exact}
    data = {
        name: (("time", dimension), series[name], {"units": unit, "long_name": text})
        for name, (dimension, unit, text) in SERIES.items()
    }
    coordinates = {
        "time": ("time", recording.time_s, {"units": "s"}),
        "joint": list(ARM_JOINTS),
        "axis": list(AXES),
    }
    dataset = xr.Dataset({**data, **_ragged_spikes(rasters, dt_s)}, coordinates)
    with atomic_path(folder / "probes.nc") as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf")


def _ragged_spikes(rasters: dict[str, np.ndarray], dt_s: float) -> dict[str, tuple]:
    """One entry per spike instead of a table of mostly zeros."""
    found = [np.nonzero(spikes) for spikes in rasters.values()]
    axes = [np.full(len(step), i) for i, (step, _) in enumerate(found)]
    step, neuron, axis = (
        np.concatenate([np.zeros(0, int), *parts])
        for parts in ([f[0] for f in found], [f[1] for f in found], axes)
    )
    return {
        "spike_time": ("spike", (step + 1) * dt_s, {"units": "s", "long_name": "M1 spike"}),
        "spike_axis": ("spike", axis, {"long_name": "number of the M1 axis"}),
        "spike_neuron": ("spike", neuron, {"long_name": "number of the neuron in its axis"}),
    }
