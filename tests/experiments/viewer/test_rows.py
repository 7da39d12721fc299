"""Rows of the time line."""

import json

import numpy as np
import xarray as xr

from spikeport.experiments.viewer.page import content
from spikeport.experiments.viewer.rows import MOST_LINES, MOST_POINTS, MOST_SPIKES, end_s, rows
from spikeport.simulation.dataset import dataset
from spikeport.simulation.recorded import Recorded


def test_errors_gates_and_spikes_come_first(series):
    found = rows(series)
    names = ["error of the hand", "gates", "spikes of gpi", "hand", "target"]
    assert [row.name for row in found] == names
    assert found[2].unit == "neuron, one of 2 drawn"
    assert found[1].labels == ["walk", "</script>"]
    np.testing.assert_allclose(found[0].values, 0.05)


def test_rows_are_no_longer_than_a_screen_can_show(series):
    for row in rows(series):
        assert len(row.times_s) == len(row.values)
        assert len(row.times_s) <= (MOST_SPIKES if row.values.ndim == 1 else MOST_POINTS)


def row_of(values, units=""):
    """Return the row of a series with a value each ms."""
    series = {"torque": (("time", "joint"), values, {"units": units})}
    (row,) = rows(xr.Dataset(series, {"time": 0.001 * np.arange(len(values))}))
    return row


def test_a_long_row_keeps_its_peaks_and_the_range_of_an_oscillation():
    values = np.zeros((5003, 2))
    values[2501, 0], values[4998:, 0] = 7.0, np.nan
    values[:, 1] = np.resize([1.0, -1.0, 0.0], 5003)
    row = row_of(values)
    assert len(row.times_s) == len(row.values) <= MOST_POINTS
    assert np.all(np.diff(row.times_s) >= 0)
    assert np.nanmax(row.values[:, 0]) == 7.0
    assert abs(row.times_s[np.nanargmax(row.values[:, 0])] - 2.501) < 0.011
    assert np.array_equal(row.values[:, 1], np.resize([-1.0, 1.0], len(row.values)))


def test_a_row_says_how_many_of_its_lines_are_drawn():
    assert row_of(np.zeros((3, MOST_LINES)), "Nm").unit == "Nm"
    row = row_of(np.zeros((3, 50)), "Nm")
    assert (row.unit, row.values.shape) == ("Nm, the first 24 of 50 lines", (3, 24))
    assert row_of(np.zeros((3, 25))).unit == "the first 24 of 25 lines"


def test_probes_of_a_network_have_rows_on_their_own_clocks():
    values = np.linspace(0, 1, 200)[:, np.newaxis]
    spikes = np.zeros((200, 3))
    spikes[[10, 50], [2, 1]] = 1000.0
    recorded = {
        "a": Recorded(0.001 * (1 + np.arange(200)), values, None, spikes=False),
        "a spikes": Recorded(0.001 * (1 + np.arange(200)), spikes, None, spikes=True),
        "rarely": Recorded(0.01 * (1 + np.arange(20)), values[::10], None, spikes=False),
    }
    probes = dataset(recorded, "native")
    found = {row.name: row for row in rows(probes)}
    assert found.keys() == {"a", "spikes of a", "rarely"}
    np.testing.assert_allclose(found["spikes of a"].times_s, [0.011, 0.051])
    assert found["spikes of a"].values.tolist() == [2, 1]
    assert end_s(probes) == 0.2


def test_probes_of_a_network_may_have_the_names_of_a_robots_series():
    names = ["hand", "target", "qpos", "reference", "state", "x_time", "x_neuron"]
    one = Recorded(0.001 * (1 + np.arange(9)), np.ones((9, 3)), None, spikes=False)
    probes = dataset(dict.fromkeys(names, one), "native")
    assert sorted(row.name for row in rows(probes)) == sorted(names)
    assert "robot" not in json.loads(content(probes))


def test_the_distance_of_a_robot_to_its_reference_is_a_row():
    places = {"moving": ["x", "y"], "turned": ["heading", "x", "y"]}
    series = {
        "reference": (("time", "moving"), np.full((5, 2), [3.0, 4.0])),
        "state": (("time", "turned"), np.zeros((5, 3))),
    }
    found = {row.name: row for row in rows(xr.Dataset(series, {"time": np.arange(5.0), **places}))}
    off_m = found["distance to the reference, which runs ahead of the robot"].values
    np.testing.assert_allclose(off_m, 5)


def test_columns_of_several_dimensions_have_all_their_names(series):
    beside = series.expand_dims({"run": ["on the chip", "in float"]}, axis=1)[["hand"]]
    (row,) = rows(beside)
    assert row.labels[:2] == ["on the chip x", "on the chip y"]
    assert row.values.shape == (200, 6)
