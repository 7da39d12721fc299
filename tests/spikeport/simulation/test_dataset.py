"""Recordings as labelled time series."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from spikeport.experiments import run_folder
from spikeport.simulation.dataset import dataset
from spikeport.simulation.recorded import Recorded


@pytest.mark.slow
def test_every_probe_is_a_variable_with_its_clock(ran, tmp_path):
    run_folder.write_probes(tmp_path, dataset(ran.recorded, "native"))
    with xr.open_dataset(tmp_path / "probes.nc") as read:
        names = ["costs $ and|or $", "a spikes", "probe time_1_s", "stimulus"]
        assert sorted(read.data_vars) == sorted([*names, *(f"{name} in float" for name in names)])
        for name, one in zip(names, ran.recorded.values(), strict=True):
            np.testing.assert_array_equal(read[name], one.values)
            np.testing.assert_array_equal(read[f"{name} in float"], one.values_float)
            clock = read[read[name].dims[0]]
            np.testing.assert_array_equal(clock, one.times_s)
            assert clock.attrs["units"] == "s"
            assert read[name].attrs["spikes"] == int(name == "a spikes")


def test_a_dataset_without_a_float_run_has_no_variables_in_float(ran):
    alone = {name: replace(one, values_float=None) for name, one in ran.recorded.items()}
    assert not [name for name in dataset(alone, "native") if "in float" in name]


def test_clocks_that_only_begin_alike_stay_separate():
    """Samples every 2.4 and every 2.5 ms are in the same steps at first."""
    times_s = [0.001 * np.array(steps) for steps in ([3, 5, 8, 10, 12], [3, 5, 8, 10, 13])]
    recorded = {
        name: Recorded(times, np.ones((len(times), 1)), None, spikes=False)
        for name, times in zip("abcd", (*times_s, times_s[0][:4], times_s[0]), strict=True)
    }
    found = dataset(recorded, "native")
    for name, one in recorded.items():
        np.testing.assert_array_equal(found[found[name].dims[0]], one.times_s)
    assert found["a"].dims[0] == found["d"].dims[0] == "time_s"


@pytest.mark.parametrize(
    ("labels", "names"),
    [
        (["v", "v_i", "size_2"], ["v", "v_i", "probe size_2"]),
        (["a/b", "a|b", "a\0b"], ["a|b", "a|b#2", "a|b#3"]),
        (["x", "x in float"], ["x", "x in float#2"]),
        (["x in float", "x"], ["x in float", "x#2"]),
        ([".", "..", "time_s", "probe time_s"], ["|", "..", "probe time_s", "probe time_s#2"]),
    ],
)
def test_every_probe_keeps_its_own_variables_whatever_the_labels_are(labels, names, tmp_path):
    times_s = 0.001 * np.arange(1, 4)
    recorded = {
        label: Recorded(times_s, np.full((3, 2), i), np.full((3, 2), -i), spikes=False)
        for i, label in enumerate(labels)
    }
    run_folder.write_probes(tmp_path, dataset(recorded, "native"))
    with xr.open_dataset(tmp_path / "probes.nc") as read:
        assert sorted(read.data_vars) == sorted([*names, *(f"{name} in float" for name in names)])
        for name, one in zip(names, recorded.values(), strict=True):
            np.testing.assert_array_equal(read[name], one.values)
            np.testing.assert_array_equal(read[f"{name} in float"], one.values_float)
