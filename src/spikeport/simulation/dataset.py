"""The recordings of a run as labelled time series, for ``probes.nc``."""

import itertools
import re
from collections.abc import Mapping

import xarray as xr

from spikeport.simulation.recorded import Recorded

NOT_IN_NAMES = re.compile(r"[/\0]|^\.$")
"""Characters that NetCDF has for groups and the end of a name, and its name for a whole file."""
OURS = ("time_", "size_")
"""Prefixes of the names of clocks and dimensions, which no probe's name may have."""


def dataset(recorded: Mapping[str, Recorded], backend: str) -> xr.Dataset:
    """Return a variable for each probe on the backend, and one in float Nengo, (time, size) each.

    The attribute ``run`` of a variable is the backend's name, or ``float`` if it was run there,
    too. Probes that sample at other times have a time axis of their own. A slash in a name becomes
    a bar, and a name that another variable has gets a number.
    """
    variables: dict[str, xr.Variable] = {}
    clocks: dict[bytes, str] = {}
    names = _names(recorded)
    for probe, one in recorded.items():
        clock = clocks.setdefault(one.times_s.tobytes(), _clock(len(clocks)))
        variables[clock] = xr.Variable(clock, one.times_s, {"units": "s"})
        runs = {backend: one.values, "float": one.values_float}
        for (run, values), name in zip(runs.items(), names[probe], strict=True):
            if values is not None:
                kind = {"long_name": names[probe][0], "run": run, "spikes": int(one.spikes)}
                dimensions = clock, f"size_{values.shape[1]}"
                variables[name] = xr.Variable(dimensions, values, kind)
    return xr.Dataset(variables)


def _names(probes: Mapping[str, Recorded]) -> dict[str, tuple[str, str]]:
    """Return the names of each probe's variables, on the backend and in float; no two are equal."""
    names: dict[str, tuple[str, str]] = {}
    taken = set[str]()
    for probe in probes:
        name = NOT_IN_NAMES.sub("|", probe)
        name = f"probe {name}" if name.startswith(OURS) else name
        numbered = itertools.chain([name], (f"{name}#{i}" for i in itertools.count(2)))
        pairs = ((one, f"{one} in float") for one in numbered)
        names[probe] = next(pair for pair in pairs if taken.isdisjoint(pair))
        taken.update(names[probe])
    return names


def _clock(number: int) -> str:
    return "time_s" if number == 0 else f"time_{number}_s"
