"""The paper's Fig. 5b: how well the robot follows its path, over a sweep of the policy's neurons.

Under the error from the path, for which a robot that fell lies there to the end, the share of runs
that fell.
"""

import xarray as xr
from matplotlib.figure import Figure

from spikeport.experiments.sweep.figure import metrics_figure
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Sweep

METRICS = ("path_mse_m2", "cross_track_rms_m", "falls")


def figure(sweep: Sweep, _folder: SweepFolder, table: xr.Dataset) -> Figure:
    """Draw a sweep of `spikeport.experiments.walk.trial`."""
    return metrics_figure(sweep, table, METRICS)
