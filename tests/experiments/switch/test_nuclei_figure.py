"""Spikes of the basal ganglia in the figure of a switching run."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from spikeport.experiments.switch.nuclei_figure import NUCLEI, Window, draw_nuclei


def test_neurons_are_sorted_by_rate_and_as_opaque_as_its_square_root(worked):
    run = worked("reach")
    step = np.arange(len(run.gates))[:, np.newaxis]
    # Two neurons of each action: at 200 Hz and at 50 Hz, and at 200 Hz and silent.
    run.spikes = {"stn": step % [5, 20, 5, 1] == [0, 0, 0, 1]}
    rows = dict(zip(NUCLEI, Figure().subplots(len(NUCLEI)), strict=True))
    draw_nuclei(rows, run, Window.whole(run))
    (image,) = rows["stn"].images
    opacity = np.asarray(image.get_array())[..., 3]
    # Over the whole run the fastest have 0.75; at a quarter of their rate it is half of that.
    np.testing.assert_allclose(opacity, np.tile([[0.375], [0.75], [0.0], [0.75]], 300))


@pytest.mark.parametrize(("n_steps", "n_bins"), [(10, 0), (30, 1)])
def test_a_run_that_ends_at_once_is_drawn(worked, n_steps, n_bins):
    run = worked("reach")
    run.gates, run.spikes = run.gates[:n_steps], {"stn": np.ones((n_steps, 4), dtype=bool)}
    rows = dict(zip(NUCLEI, Figure().subplots(len(NUCLEI)), strict=True))
    draw_nuclei(rows, run, Window.whole(run))
    widths = [image.get_extent()[1] for image in rows["stn"].images]
    assert widths == n_bins * [pytest.approx(0.02)]
