"""The picture of a run: each probe, on the backend and in float Nengo, with its error."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spikeport.counted import percent
from spikeport.plots import plain
from spikeport.simulation.recorded import Recorded

ROWS = 12
"""Most panels in a column; more panels take further columns."""
MOST = 240
"""Most panels: with more, a picture would have more pixels than matplotlib draws."""
LINES = 8
"""Most dimensions of a probe that are drawn, those of the largest rms: more lines would not be
distinct."""
WIDTH_IN, HEIGHT_IN = 7.0, 1.9
EXACT = "#9a9da3"


def figure(recorded: Mapping[str, Recorded], backend: str, title: str) -> Figure:
    """Draw every probe: in colours on the backend, and beneath it in grey in float Nengo."""
    shown = list(recorded.items())[:MOST]
    columns = -(-len(shown) // ROWS)
    rows = -(-len(shown) // columns)
    drawn = Figure(figsize=(WIDTH_IN * columns, 0.6 + HEIGHT_IN * rows), layout="constrained")
    panels = drawn.subplots(rows, columns, squeeze=False).T.ravel()
    for axes, (name, one) in zip(panels, shown, strict=False):
        (_draw_spikes if one.spikes else _draw_values)(axes, one)
        axes.set_title(plain(name) + _in_words(one), loc="left", fontsize="medium")
        axes.set_xlabel("time (s)")
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    beside = any(one.values_float is not None for one in recorded.values())
    more = f"; {len(recorded) - MOST} more in probes.nc" if len(recorded) > MOST else ""
    legend = f"colours: {backend}" + ("; grey: float Nengo" * beside) + more
    drawn.suptitle(f"{plain(title)}\n{legend}", fontsize="large")
    return drawn


def _in_words(one: Recorded) -> str:
    error = one.error()
    size = one.values.shape[1]
    text = "" if error is None else f": {percent(error)} off"
    if size > LINES and not one.spikes:
        text = f", the {LINES} largest of {size} dimensions{text}"
    if (late := one.best_delay()) is not None:
        text += f", {percent(late[1])} with its delay of {1000 * late[0]:.0f} ms removed"
    return text


def _draw_values(axes: Axes, one: Recorded) -> None:
    # A line through a single sample has no length: it would not be seen.
    dots = "o" if len(one.times_s) == 1 else ""
    largest = np.sort(np.argsort(-np.linalg.norm(one.values, axis=0), kind="stable")[:LINES])
    if one.values_float is not None:
        exact = one.values_float[:, largest]
        axes.plot(one.times_s, exact, dots + "-", color=EXACT, lw=2.5, ms=6)
    axes.plot(one.times_s, one.values[:, largest], dots + "-", lw=1, ms=4)


def _draw_spikes(axes: Axes, one: Recorded) -> None:
    """Draw a dot for each spike; float Nengo's spikes are above a line, upside down."""
    size = one.values.shape[1]
    if one.values_float is not None:
        step, neuron = np.nonzero(one.values_float)
        axes.plot(one.times_s[step], 2 * size - neuron, ".", color=EXACT, ms=1.5)
        axes.axhline(size + 0.5, color="black", lw=0.5)
    step, neuron = np.nonzero(one.values)
    axes.plot(one.times_s[step], neuron + 1, ".", ms=1.5)
    axes.set_ylabel("neuron")
    axes.set_yticks([1, size])
