"""A sweep that is finished but for one point."""

import pytest

from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.table import table
from tests.helpers.sweeps import VARIED, finish


@pytest.fixture
def finished(sweep_of, tmp_path):
    """A sweep of which one point of eight failed, its folder and its table."""
    sweep = sweep_of(varied=VARIED, seeds=(3, 4))
    folder = SweepFolder(tmp_path)
    for point in sweep.points()[:-1]:
        error = point.place["n_neurons"] + 0.1 * point.place["seed"]
        metrics = {"path_mse_m2": error, "cross_track_rms_m": 0.1, "falls": 0}
        finish(folder, point, **metrics, fallen_at_s=None, rates=[1.0])
    return sweep, folder, table(sweep, folder)
