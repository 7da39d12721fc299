"""Time series like those of a humanoid's run, of a robot that is lifted."""

import numpy as np
import pytest
import xarray as xr

from spikeport.robot.plant import Plant


@pytest.fixture(scope="session")
def series() -> xr.Dataset:
    """Return one second of a run: poses, gates, errors and spikes."""
    plant, time_s = Plant(), np.arange(200) * 0.005
    poses = np.tile(plant.data.qpos, (200, 1))
    poses[:, 2] += time_s
    target = np.zeros((200, 3))
    hand = target + np.array([0.03, 0.04, 0])
    gates = np.zeros((1000, 2))
    gates[500:, 1] = 1
    return xr.Dataset(
        {
            "qpos": (("time", "coordinate"), poses),
            "hand": (("time", "axis"), hand, {"units": "m"}),
            "target": (("time", "axis"), target, {"units": "m"}),
            "gates": (("step", "selectable"), gates),
            "gpi_time": ("gpi_spike", np.linspace(0, 1, 30_001)),
            "gpi_neuron": ("gpi_spike", np.arange(30_001) % 50),
        },
        {
            "time": time_s,
            "step": (1 + np.arange(1000)) * 0.001,
            "axis": list("xyz"),
            "selectable": ["walk", "</script>"],
        },
    )
