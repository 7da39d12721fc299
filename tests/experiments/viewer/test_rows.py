"""Rows of the time line."""

import numpy as np

from spikeport.experiments.viewer.rows import MOST_POINTS, MOST_SPIKES, rows


def test_errors_gates_and_spikes_come_first(series):
    found = rows(series)
    names = ["error of the hand", "gates", "spikes of gpi, one of 2 drawn", "hand", "target"]
    assert [row.name for row in found] == names
    assert found[1].labels == ["walk", "</script>"]
    np.testing.assert_allclose(found[0].values, 0.05)


def test_rows_are_no_longer_than_a_screen_can_show(series):
    for row in rows(series):
        assert len(row.times_s) == len(row.values)
        assert len(row.times_s) <= (MOST_SPIKES if row.values.ndim == 1 else MOST_POINTS)


def test_columns_of_several_dimensions_have_all_their_names(series):
    beside = series.expand_dims({"run": ["on the chip", "in float"]}, axis=1)[["hand"]]
    (row,) = rows(beside)
    assert row.labels[:2] == ["on the chip x", "on the chip y"]
    assert row.values.shape == (200, 6)
