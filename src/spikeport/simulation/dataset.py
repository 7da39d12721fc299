"""The recordings of a run as labelled time series, for ``probes.nc``."""

from collections.abc import Mapping

import xarray as xr

from spikeport.simulation.recorded import Recorded


def dataset(recorded: Mapping[str, Recorded], backend: str) -> xr.Dataset:
    """Return a variable for each probe, (run, time, size).

    ``run`` is the backend and, where there was one, the run in float Nengo. Probes that sample at
    other times have a time axis of their own. A slash in a name, which NetCDF has for groups,
    becomes a bar.
    """
    variables: dict[str, xr.Variable] = {}
    clocks: dict[bytes, str] = {}
    for name, one in recorded.items():
        clock = clocks.setdefault(one.times_s.tobytes(), _clock(len(clocks)))
        name = name.replace("/", "|")
        name = f"probe {name}" if name.startswith("time_") else name  # names of clocks
        variables[clock] = xr.Variable(clock, one.times_s, {"units": "s"})
        runs = {backend: one.values, "float": one.values_float}
        for run, values in runs.items():
            if values is not None:
                kind = {"long_name": name, "run": run, "spikes": int(one.spikes)}
                label = name if run == backend else f"{name} in float"
                variables[label] = xr.Variable((clock, f"{name}_i"), values, kind)
    return xr.Dataset(variables)


def _clock(number: int) -> str:
    return "time_s" if number == 0 else f"time_{number}_s"
