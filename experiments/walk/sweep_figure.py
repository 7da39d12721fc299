"""The paper's Fig. 5b: how well the robot follows its path, over a sweep of the policy's neurons.

Errors are of runs that walked to their end: a robot that fell lies where it fell, near its path if
it fell early. Under the errors is the share of runs that fell.
"""

import xarray as xr
from matplotlib.figure import Figure

from spikeport.experiments.sweep.figure import metrics_figure
from spikeport.experiments.sweep.folder import SweepFolder
from spikeport.experiments.sweep.plan import Sweep

ERRORS, FALLS = ("path_mse_m2", "cross_track_rms_m"), "falls"


def figure(sweep: Sweep, _folder: SweepFolder, table: xr.Dataset) -> Figure:
    """Draw a sweep of `spikeport.experiments.walk.trial`."""
    return metrics_figure(sweep, of_walks(table), [*ERRORS, FALLS])


def of_walks(table: xr.Dataset) -> xr.Dataset:
    """Return a table whose errors are NaN where the robot fell."""
    walked = table[FALLS] == 0
    return table.assign({name: table[name].where(walked) for name in ERRORS})
