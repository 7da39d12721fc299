"""Rows of a run's time line: lines of values, and dots of spikes."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

MOST_POINTS = 1000
"""The most points of a line: more than a screen has columns."""
MOST_SPIKES = 20_000
"""The most dots of a row: of more spikes only every n-th is drawn, and the row's unit says so."""
MOST_LINES = 24
FIRST = ("error", "gates", "spike", "command", "torque")
"""Parts of the names of the first rows, in their order; the other rows follow."""
POSES = "qpos"
CLOCKS = ("time", "step")
"""First words of the names of time axes."""


class Row(NamedTuple):
    """A row of the time line.

    Attributes
    ----------
    name : str
        Its title, by which a live page finds the row again.
    unit : str
        The unit of its values, and how many of them are drawn if not all.
    times_s : (n,) array
        The times of its values or spikes, in s.
    values : (n, lines) or (n,) array
        Values of each line; for spikes the numbers of their neurons.
    labels : list of str
        The name of each line; empty for spikes.
    """

    name: str
    unit: str
    times_s: np.ndarray
    values: np.ndarray
    labels: list[str]


def rows(probes: xr.Dataset) -> list[Row]:
    """Return all rows of a run's time series, errors, gates and spikes first."""
    found = [*_errors(probes), *_lines(probes), *_spikes(probes)]
    return sorted(found, key=lambda row: _place(row.name))


def end_s(probes: xr.Dataset) -> float:
    """Return the last time of a run's time series, in s."""
    ends = [float(probes[name].max()) for name in probes.sizes if _is_clock(probes, str(name))]
    return max(ends, default=0.0)


def of_robot(probes: xr.Dataset, *names: str, **dimensions: str) -> bool:
    """Return whether series are a robot's: on its clock, and along the ``dimensions`` by name.

    Probes of a network may have the same names, but their time axes have other names, see
    `spikeport.simulation.dataset`.
    """
    on_its_clock = all(
        name in probes and probes[name].dims[:1] == ("time",) for name in (*names, *dimensions)
    )
    return on_its_clock and all(along in probes[name].dims for name, along in dimensions.items())


def _is_clock(probes: xr.Dataset, name: str) -> bool:
    return name.split("_")[0] in CLOCKS and name in probes.coords and probes.sizes[name] > 0


def _place(name: str) -> int:
    return next((i for i, part in enumerate(FIRST) if part in name), len(FIRST))


def _errors(probes: xr.Dataset) -> Iterator[Row]:
    """Yield the distances of the hand from its target, and of the robot from its reference."""
    if of_robot(probes, "hand", "target"):
        yield _error(probes, "error of the hand", probes.target.values - probes.hand.values)
    if of_robot(probes, reference="moving", state="turned"):
        place = probes.state.sel(turned=["x", "y"]).values
        there = probes.reference.sel(moving=["x", "y"]).values
        name = "distance to the reference, which runs ahead of the robot"
        yield _error(probes, name, place - there)


def _error(probes: xr.Dataset, name: str, off_m: np.ndarray) -> Row:
    return _thinned(name, "m", probes.time.values, np.linalg.norm(off_m, axis=1)[:, np.newaxis], [])


def _lines(probes: xr.Dataset) -> Iterator[Row]:
    for name, series in probes.data_vars.items():
        along = str(series.dims[0]) if series.dims else ""
        drawn = name == POSES and of_robot(probes, POSES)
        is_series = _is_clock(probes, along) and not drawn
        if is_series and series.attrs.get("spikes"):
            yield _dots(str(name).removesuffix(" spikes"), probes[along].values, series.values)
        elif is_series and np.issubdtype(series.dtype, np.number):
            # Further dimensions become lines of their own.
            values = series.values.reshape(len(series), -1)[:, :MOST_LINES]
            labels = _labels(series) if series.ndim > 1 else []
            yield _thinned(str(name), _unit(series), probes[along].values, values, labels)


def _unit(series: xr.DataArray) -> str:
    """Return the unit of a series, and the share of its lines that is drawn if not all are."""
    n_lines = series[:1].size
    more = [f"the first {MOST_LINES} of {n_lines:,} lines"] if n_lines > MOST_LINES else []
    unit = str(series.attrs.get("units", ""))
    return ", ".join([unit] * bool(unit) + more)


def _labels(series: xr.DataArray) -> list[str]:
    """Return a name for each line: its coordinates, one after the other."""
    names = (series[along].values[:MOST_LINES] for along in series.dims[1:])
    first = itertools.islice(itertools.product(*names), MOST_LINES)
    return [" ".join(map(str, parts)) for parts in first]


def _thinned(
    name: str, unit: str, times_s: np.ndarray, values: np.ndarray, labels: list[str]
) -> Row:
    """Return the row of a series; of a long one, the least and the largest value of each stretch.

    A value of every stretch would lose peaks, and draw an oscillation as another, slower one.
    """
    values = values.astype(float)
    if len(times_s) > MOST_POINTS:
        first = np.arange(0, len(times_s), -(-2 * len(times_s) // MOST_POINTS))
        ends = [end.reduceat(values, first) for end in (np.fmin, np.fmax)]
        values = np.stack(ends, axis=1).reshape(-1, values.shape[1])
        times_s = np.repeat(times_s[first], 2)
    return Row(name, unit, times_s, values, labels)


def _spikes(probes: xr.Dataset) -> Iterator[Row]:
    for name in map(str, probes.data_vars):
        neurons = f"{name.removesuffix('_time')}_neuron"
        if not name.endswith("_time") or neurons not in probes or probes[name].ndim > 1:
            continue
        title = name.removesuffix("_time")
        yield _thinned_spikes(title, probes[name].values, probes[neurons].values)


def _dots(name: str, times_s: np.ndarray, spikes: np.ndarray) -> Row:
    """Return the row of a probe of spikes, (n, neurons)."""
    step, neuron = np.nonzero(spikes)
    return _thinned_spikes(name, times_s[step], neuron)


def _thinned_spikes(title: str, times_s: np.ndarray, neurons: np.ndarray) -> Row:
    # Spikes are in the order of time, so every n-th is spread over all neurons.
    step = max(1, -(-len(times_s) // MOST_SPIKES))
    name = "spikes" if title in ("", "spike") else f"spikes of {title}"
    # This is not in the name, since a smaller share of spikes is drawn as a run grows.
    thinned = "" if step == 1 else f", one of {step} drawn"
    return Row(name, f"neuron{thinned}", times_s[::step], neurons[::step], [])
