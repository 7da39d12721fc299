"""Spikes among a run's time series."""

import numpy as np
import xarray as xr

from spikeport.experiments.spikes import ragged


def test_every_spike_has_its_time_and_neuron_by_population():
    rasters = {name: np.zeros((5, 4)) for name in ("M1_x", "M1_y", "quiet")}
    rasters["M1_x"][0, 2] = rasters["M1_x"][3, 1] = rasters["M1_y"][4, 0] = 1
    found = xr.Dataset(ragged(rasters))
    np.testing.assert_allclose(found.M1_x_time, [0.001, 0.004])
    assert found.M1_x_neuron.values.tolist() == [2, 1]
    np.testing.assert_allclose(found.M1_y_time, [0.005])
    assert found.M1_x_time.attrs["units"] == "s"
    assert found.sizes["quiet_spike"] == 0


def test_a_run_without_populations_has_no_series_of_spikes():
    assert ragged({}) == {}
