"""A toy chip with round figures, and activities to estimate from."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from spikeport.hardware_models.activity import PER_STEP, Activity
from spikeport.hardware_models.chip import ChipModel


def figure(value: float, unit: str, low: float | None = None, high: float | None = None) -> dict:
    return {
        "value": value,
        "unit": unit,
        "low": low,
        "high": high,
        "source": "a paper",
        "evidence": "vendor",
    }


def toy_data() -> dict[str, Any]:
    """Return a chip of 2 x 2 tiles, two cores each; energies and times from 50 % to 200 %."""
    energies = {
        "synaptic_operation": 1,
        "update_active": 10,
        "update_inactive": 5,
        "spike": 100,
        "message": 1000,
        "hop_east_west": 2,
        "hop_north_south": 3,
    }
    times = {
        "synaptic_operation": 1,
        "update_active": 10,
        "update_inactive": 5,
        "spike": 100,
        "message_in": 7,
    }
    barrier = [{"tiles": 1, **figure(1, "us", 0.5, 2)}, {"tiles": 3, **figure(2, "us", 1, 4)}]
    limits = [
        "compartments",
        "in_axons",
        "out_axons",
        "compartment_profiles",
        "threshold_profiles",
        "synapse_profiles",
    ]
    return {
        "schema": 1,
        "name": "toy",
        "title": "Toy",
        "limits": {
            "cores": figure(8, "1"),
            "chips": figure(1, "1"),
            "synapse_bits": figure(640, "bit"),
            **{name: figure(10, "1") for name in limits},
        },
        "topology": {
            "tiles_x": figure(2, "1"),
            "tiles_y": figure(2, "1"),
            "cores_per_tile": figure(2, "1"),
        },
        "power": {
            "static_chip_w": figure(100, "mW", 90, 110),
            "board_idle_w": figure(1, "W", 1, 1.5),
        },
        "calibrations": [
            {
                "name": "bench",
                "description": "made up",
                "energies": {k: figure(v, "pJ", v / 2, v * 2) for k, v in energies.items()},
                "times": {k: figure(v, "ns", v / 2, v * 2) for k, v in times.items()},
                "barrier": barrier,
            },
            {"name": "empty", "description": "no public figure"},
        ],
    }


@pytest.fixture
def data() -> dict[str, Any]:
    return toy_data()


@pytest.fixture
def chip(data: dict[str, Any]) -> ChipModel:
    return ChipModel.model_validate(data)


@pytest.fixture
def make_activity() -> Callable[..., Activity]:
    """Return a function that makes an activity, all zero except for its arguments."""

    def make(n_steps: int = 2, n_cores: int = 2, dt_s: float = 0.001, **counts: Any) -> Activity:
        arrays = {name: np.zeros((n_steps, n_cores), dtype=int) for name in PER_STEP}
        arrays["messages"] = np.zeros((n_cores, n_cores), dtype=int)
        arrays["messages_host"] = np.zeros(n_cores, dtype=int)
        arrays["host_spikes"] = np.zeros(n_steps, dtype=int)
        readout_spikes = counts.pop("readout_spikes", 0)
        arrays |= {name: np.array(count) for name, count in counts.items()}
        cores = tuple(f"core {k}" for k in range(n_cores))
        return Activity(cores=cores, dt_s=dt_s, readout_spikes=readout_spikes, **arrays)

    return make
