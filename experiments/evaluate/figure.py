"""The picture of a robustness table: falls, tracking and joint speeds, row by row."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.experiments.evaluate.interval import Interval
from spikeport.experiments.evaluate.measures import MEASURES
from spikeport.experiments.evaluate.table import TableRow
from spikeport.plots import plain

DRAWN = ("speed_error_m_s", "yaw_rate_error_rad_s", "speed_use", "clearance_m", "impact_bw")
COLOR, FELL = "#1f6f9a", "#c62828"
ROW_INCH, PANEL_INCH = 0.24, 2.3


def figure(rows: Sequence[TableRow], title: str) -> Figure:
    """Draw the share of falls, and some means, with their intervals."""
    size = PANEL_INCH * (len(DRAWN) + 1) + 3, 1.5 + ROW_INCH * len(rows)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(1, len(DRAWN) + 1, sharey=True)
    _draw(axes[0], [one.fell for one in rows], "share that fell", FELL)
    axes[0].set_xlim(-0.03, 1.03)
    for axis, name in zip(axes[1:], DRAWN, strict=True):
        _draw(axis, [one.means[name] for one in rows], MEASURES[name].heading, COLOR)
    axes[0].set_yticks(range(len(rows)), [plain(one.name) for one in rows], fontsize=8)
    # The first row on top, as in the table.
    axes[0].invert_yaxis()
    figure.suptitle(plain(title))
    return figure


def _draw(axes: Axes, intervals: Sequence[Interval | None], label: str, color: str) -> None:
    for place, one in enumerate(intervals):
        if one is None:
            continue
        if one.low is not None and one.high is not None:
            axes.plot([one.low, one.high], [place, place], color=color, lw=1.5, alpha=0.5)
        axes.plot(one.estimate, place, "o", color=color, ms=4)
    axes.set_xlabel(label, fontsize=9)
    axes.set_yticks(np.arange(len(intervals)))
    axes.grid(axis="both", alpha=0.25)
