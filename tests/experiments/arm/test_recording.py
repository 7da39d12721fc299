"""Recordings of the arm, as a run writes them."""

import numpy as np
import pytest
import xarray as xr

from spikeport.experiments.arm.recording import dataset
from tests.helpers.arm_runs import finished

SERIES = {
    "q": ("joint", "rad"),
    "dq": ("joint", "rad/s"),
    "hand": ("axis", "m"),
    "target": ("axis", "m"),
    "torque": ("joint", "N m"),
    "exact_torque": ("joint", "N m"),
}


@pytest.mark.slow
def test_the_probes_have_names_and_units(loihi):
    with xr.open_dataset(loihi.folder / "probes.nc", engine="h5netcdf") as probes:
        for name, (dimension, unit) in SERIES.items():
            assert probes[name].dims == ("time", dimension)
            assert probes[name].attrs["units"] == unit
            assert probes[name].attrs["long_name"]
            assert np.isfinite(probes[name]).all()
        assert probes.time.attrs["units"] == "s"
        assert probes.time.values == pytest.approx(np.arange(200) * 0.005)
        assert probes.axis.values.tolist() == ["x", "y", "z"]
        assert probes.joint.values.tolist() == [
            *("right_shoulder_pitch", "right_shoulder_roll", "right_shoulder_yaw", "right_elbow")
        ]


@pytest.mark.slow
def test_the_probes_have_plausible_spikes_of_every_recorded_population(loihi):
    with xr.open_dataset(loihi.folder / "probes.nc", engine="h5netcdf") as probes:
        for population in ("M1_x", "M1_y", "M1_z"):
            assert probes[f"{population}_time"].attrs["units"] == "s"
            times = probes[f"{population}_time"].values
            assert 0.001 <= times.min() < times.max() <= 1.0
            assert times * 1000 == pytest.approx(np.round(times * 1000))
            assert set(probes[f"{population}_neuron"].values) <= set(range(60))
            per_neuron_hz = len(times) / 60
            assert 20 < per_neuron_hz < 400


def test_the_probes_have_every_spike_of_the_rasters():
    drawn = np.random.default_rng(0).random((200, 60)) < 0.1
    run = finished([0.1])._replace(rasters={"x": drawn, "z": np.zeros((200, 60), dtype=bool)})
    probes = dataset(run)
    found = np.zeros_like(drawn)
    found[np.round(probes.M1_x_time * 1000).astype(int) - 1, probes.M1_x_neuron] = True
    np.testing.assert_array_equal(found, drawn)
    assert len(probes.M1_x_time) == drawn.sum()
    assert probes.sizes["M1_z_spike"] == 0


@pytest.mark.slow
def test_the_probes_agree_with_the_metrics(loihi):
    with xr.open_dataset(loihi.folder / "probes.nc", engine="h5netcdf") as probes:
        distance = np.linalg.norm(probes.target - probes.hand, axis=1)
        error = probes.torque - probes.exact_torque
    figures = loihi.result["metrics"]
    assert figures["distance_rms_m"] == pytest.approx(np.sqrt(np.mean(distance**2)))
    assert figures["torque_error_rms_nm"] == pytest.approx(np.sqrt((error**2).mean(axis=0)).values)


@pytest.mark.slow
def test_a_controller_without_neurons_has_no_spikes(run):
    folder = run(0.05, backend="analytic").folder
    with xr.open_dataset(folder / "probes.nc", engine="h5netcdf") as probes:
        assert not [name for name in probes if name.startswith("M1")]
        assert probes.sizes["time"] == 10
