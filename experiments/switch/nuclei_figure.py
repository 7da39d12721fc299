"""Spikes of the basal ganglia, under their inputs and outputs (paper, Fig. 6).

The neurons of each action are sorted by rate. Over the whole run, their colour shows how often they
fire; around a switch, every spike is a line.
"""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patheffects import Normal, Stroke
from matplotlib.ticker import MaxNLocator

from spikeport.constants import DT_S
from spikeport.experiments.switch.picture import COLOURS
from spikeport.experiments.switch.recording import SwitchRun
from spikeport.networks.humanoid import ACTIONS

NUCLEI = {"strD1": "strD1", "strD2": "strD2", "stn": "STN", "gpi": "GPi"}
BIN_S = 0.02
"""Rates, and gates over the whole run, are averaged over this time."""
BEFORE_S, AFTER_S = 0.04, 0.10
"""The time before and after a switch in the figure."""
STRONGEST = 0.75
"""Opacity of the fastest neurons over the whole run, below 1 so that lines stand out."""
LINE_WIDTH = 2.6
HALO = [Stroke(linewidth=6, foreground="white"), Normal()]
"""The outline of lines that lie over spikes of the same colour."""


class Window(NamedTuple):
    """The time that a picture shows, its axis and its bins.

    Attributes
    ----------
    begin_s, end_s : float
        First and last moment, in the run's time.
    zero_s : float
        The moment that is 0 on the axis.
    unit_s : float
        Unit of the axis.
    bin_s : float
        The time that rates are averaged over.
    """

    begin_s: float
    end_s: float
    zero_s: float
    unit_s: float
    bin_s: float

    @classmethod
    def whole(cls, run: SwitchRun) -> "Window":
        """Return the window of a whole run."""
        return cls(0.0, len(run.gates) * DT_S, 0.0, 1.0, BIN_S)

    @classmethod
    def around(cls, switch_s: float) -> "Window":
        """Return the window around a switch, in milliseconds."""
        return cls(switch_s - BEFORE_S, switch_s + AFTER_S, switch_s, 1e-3, DT_S)

    @property
    def extent(self) -> tuple[float, float]:
        """Beginning and end in the window's unit."""
        return (self.begin_s - self.zero_s) / self.unit_s, (self.end_s - self.zero_s) / self.unit_s

    def binned(self, series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return times (m,) in the window's unit, and means (m, n) of a series (n_steps, n)."""
        begin, end, width = (
            round(s / DT_S) for s in (max(self.begin_s, 0), self.end_s, self.bin_s)
        )
        part = series[begin:end]
        # A bin that is not full at the end is left out.
        means = part[: len(part) // width * width].reshape(-1, width, part.shape[1]).mean(axis=1)
        time_s = begin * DT_S + (np.arange(len(means)) + 0.5) * self.bin_s
        return (time_s - self.zero_s) / self.unit_s, means


def draw_nuclei(rows: dict[str, Axes], run: SwitchRun, window: Window) -> None:
    """Draw each nucleus on its axes, one above the other."""
    for name, axes in rows.items():
        axes.set_xlim(window.extent)
        if name in run.spikes:
            _draw_spikes(axes, run.spikes[name], window)
        for goal in run.goals:
            moment = (goal.phase.begin_s - window.zero_s) / window.unit_s
            if window.extent[0] < moment < window.extent[1]:
                axes.axvline(moment, color="black", lw=0.8)
        axes.set_yticks([])
        axes.tick_params(labelbottom=False)
        axes.xaxis.set_major_locator(MaxNLocator(steps=[1, 2, 5, 10]))
    bottom = rows["gpi"]
    bottom.tick_params(labelbottom=True)
    _draw_utilities(_over(rows["strD1"], "utility"), run, window)
    _draw_gates(_over(bottom, "gate"), run, window)


def name_nuclei(rows: dict[str, Axes]) -> None:
    """Write the name of each nucleus beside it, and each action beside its neurons."""
    for name, axes in rows.items():
        axes.set_ylabel(NUCLEI[name], fontsize=13, fontweight="bold", labelpad=34)
        for number, action in enumerate(ACTIONS):
            place = (number + 0.5) / len(ACTIONS)
            axes.text(
                -0.006,
                place,
                action,
                transform=axes.transAxes,
                ha="right",
                va="center",
                color=COLOURS[action],
            )


def _draw_spikes(axes: Axes, raster: np.ndarray, window: Window) -> None:
    """Draw spikes (n_steps, n_neurons), in the colours of their actions."""
    size = raster.shape[1] // len(ACTIONS)
    order = np.argsort(raster.sum(axis=0).reshape(-1, size), axis=1)
    ordered = raster[:, (order + size * np.arange(len(ACTIONS))[:, np.newaxis]).ravel()]
    times, rates = window.binned(ordered)
    if not len(times):  # the robot fell before a bin was full
        return
    colours = np.repeat([to_rgb(colour) for colour in COLOURS.values()], size, axis=0)
    strongest = 1.0 if window.bin_s == DT_S else STRONGEST
    # The square root makes slow neurons visible beside fast ones.
    share = strongest * np.sqrt(rates.T / max(rates.max(), DT_S))
    image = np.concatenate(
        (np.broadcast_to(colours[:, np.newaxis], (*share.shape, 3)), share[..., np.newaxis]), axis=2
    )
    half = window.bin_s / window.unit_s / 2
    extent = (times[0] - half, times[-1] + half, 0, len(share))
    axes.imshow(image, aspect="auto", origin="lower", extent=extent, interpolation="nearest")
    axes.axhline(size, color="white", lw=2)


def _draw_utilities(axes: Axes, run: SwitchRun, window: Window) -> None:
    phases = [goal.phase for goal in run.goals]
    times_s = np.array([phase.begin_s for phase in phases] + [phases[-1].end_s])
    values = np.array([phase.values for phase in phases])
    edges = (times_s - window.zero_s) / window.unit_s
    for action, utility in zip(ACTIONS, values.T, strict=True):
        line = axes.stairs(utility, edges, baseline=None, color=COLOURS[action], lw=LINE_WIDTH)
        line.set_path_effects(HALO)


def _draw_gates(axes: Axes, run: SwitchRun, window: Window) -> None:
    times, gates = window.binned(run.gates)
    for action, gate in zip(ACTIONS, gates.T, strict=True):
        axes.plot(times, gate, color=COLOURS[action], lw=LINE_WIDTH, path_effects=HALO)


def _over(axes: Axes, label: str) -> Axes:
    over = axes.twinx()
    over.set(ylabel=label, ylim=(-0.08, 1.12), yticks=(0, 0.5, 1), xlim=axes.get_xlim())
    return over
