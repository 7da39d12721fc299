"""The arm's work in a switching run, on the sheet as the robot sees it."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.arm.reach_task import REACHED_M
from spikeport.experiments.run_folder import Result
from spikeport.experiments.switch.goals import Goal
from spikeport.experiments.switch.metrics import drawn, within
from spikeport.experiments.switch.picture import COLOURS
from spikeport.experiments.switch.recording import SwitchRun

TEMPLATE = "0.2"
DECIMALS = 6
"""Decimals of places in m: equal targets differ by less."""


def draw_work(axes: Axes, run: SwitchRun, phases: list[Result]) -> None:
    """Draw drawings over their templates, and the hand's ways through targets."""
    for goal in run.goals:
        if len(trace := drawn(run, goal)):
            _draw_trace(axes, goal.stroke, color=TEMPLATE, ls="--", lw=1.5)
            _draw_trace(axes, trace, color=COLOURS["draw"], lw=2.5)
        elif goal.phase.arm == "reach":
            _draw_reaches(axes, run, goal)
    title = _results(phases)
    axes.set(xlabel="right (cm)", ylabel="up (cm)", aspect="equal", title=title)
    axes.set_adjustable("datalim")
    axes.axison = bool(title)


def _draw_reaches(axes: Axes, run: SwitchRun, goal: Goal) -> None:
    """Draw the way of the hand, with a circle around each target that it had to enter."""
    now = within(run.recording.time_s, goal.phase)
    # A target is the same for many steps, except for rounding in the change of frames.
    for place in np.unique(run.arm.target[now].round(DECIMALS), axis=0):
        centre = 100 * Sheet().project(place[np.newaxis])[0]
        axes.add_patch(Circle(centre, 100 * REACHED_M, fill=False, color=TEMPLATE, ls="--"))
    _draw_trace(axes, run.local_m[now], color=COLOURS["draw"], lw=1.5)


def _draw_trace(axes: Axes, points: np.ndarray, **style: Any) -> None:
    """Draw places (n, 3) in m on the sheet."""
    axes.plot(*(100 * Sheet().project(points)).T, **style)


def _results(phases: list[Result]) -> str:
    """Return the results of drawing and of reaching, each in its own line."""
    found = {
        key: [phase[key] for phase in phases if phase.get(key) is not None]
        for key in ("shape_error_rms_m", "recognised_as", "targets_reached")
    }
    errors_m, digits, targets = found.values()
    errors_mm = ", ".join(f"{1000 * error_m:.1f}" for error_m in errors_m)
    lines = {
        f"{errors_mm} mm rms from template": errors_m,
        "read as " + ", ".join(map(str, digits)): digits,
        f"{sum(targets)} targets reached": targets,
    }
    return "\n".join(line for line, values in lines.items() if values)
