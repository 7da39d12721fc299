"""A network on a backend, beside float Nengo: what its probes record, and how far that is apart."""

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import nengo
import numpy as np

from spikeport.backends import registry
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.report.report import Report
from spikeport.errors import BackendError, SpikeportError
from spikeport.hardware_models.activity import Activity
from spikeport.progress import Progress, silent
from spikeport.simulation.probes import probes_by_name, records_spikes
from spikeport.simulator import Simulator

TAU_S = 0.02
"""The low-pass filter through which runs are compared, as those of a measured loss."""
LATEST_S = 0.05
"""The longest delay of a chip that is looked for."""
MOST_VALUES = 10**7
"""Values of a recording in which a delay is looked for, which takes a second."""
FLOAT = "reference"
PROGRESS_STEPS = 50
"""Steps from one report of progress to the next."""


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of a run.

    Attributes
    ----------
    steps : int
        Number of steps.
    backend, chip, pipeline : str
        Where it runs, and the passes of its compile; by default the chip's.
    seed : int
        Seed of noise and processes.
    beside_float : bool
        Run it in float Nengo, too, after the run on the backend.
    """

    steps: int
    backend: str = "native"
    chip: str | Path = "loihi"
    pipeline: Pipeline | str | None = None
    seed: int = 0
    beside_float: bool = True


@dataclass(frozen=True)
class Recorded:
    """The recording of a probe: times (n,) in s, and values (n, size) on the backend and in float.

    ``values_float`` is None where there was no run in float Nengo; ``spikes`` says that the values
    are spikes, and ``tau_s`` is the filter of the probe.
    """

    times_s: np.ndarray
    values: np.ndarray
    values_float: np.ndarray | None
    spikes: bool

    def error(self) -> float | None:
        """Return the error of the run on the backend.

            error = rms(values - values_float) / rms(values_float)

        Both are low-pass filtered with 20 ms before. None where there is no float run, nothing was
        recorded, or its values are zero throughout.
        """
        return None if self._filtered is None else _apart(*self._filtered)

    def delayed(self) -> tuple[float, float] | None:
        """Return the delay in s, up to 50 ms, at which the error is least, and that error.

        A chip computes later than float Nengo: values take steps from host to chip and back, and
        decode neurons have a filter of their own. None where there is no error, where it is least
        without a delay, and for recordings of more than 10^7 values.
        """
        if self._filtered is None or self.values.size > MOST_VALUES:
            return None
        ours, exact = self._filtered
        # No more than half a recording is cut off: what is left has to show the signal.
        every_s = self.times_s[1] - self.times_s[0]
        shifts = range(min(round(LATEST_S / every_s) + 1, len(ours) // 2))
        errors = [_apart(ours[k:], exact[: len(exact) - k]) for k in shifts]
        best = int(np.argmin(errors))
        return (best * every_s, errors[best]) if best else None

    @cached_property
    def _filtered(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The values of both runs, filtered; None where there are none to compare."""
        if self.values_float is None or len(self.times_s) < 2 or not self.values_float.any():
            return None
        every_s = self.times_s[1] - self.times_s[0]
        ours, exact = (
            nengo.Lowpass(TAU_S).filt(x.astype(float), dt=every_s, y0=0)
            for x in (self.values, self.values_float)
        )
        return ours, exact


class Ran(NamedTuple):
    """The outcome of a run: recordings by probe, and what the chip's report says, if there was one.

    ``report`` and ``report_json`` are None where nothing was compiled; ``wall_s`` is the wall-clock
    time that the run on the backend took.
    """

    backend: str
    recorded: dict[str, Recorded]
    activity: Activity
    report: Report | None
    report_json: dict[str, Any] | None
    wall_s: float


def _apart(ours: np.ndarray, exact: np.ndarray) -> float:
    """Return the relative rms difference; infinite of zeros."""
    norm = np.linalg.norm(exact)
    return float(np.linalg.norm(ours - exact) / norm) if norm > 0 else np.inf


def run(network: nengo.Network, options: RunOptions, progress: Progress = silent) -> Ran:
    """Run a network on a backend and, where that is asked for, in float Nengo afterwards.

    Float Nengo runs a copy, so that objects which nodes call (an environment) begin anew. Functions
    are not copied: what they close over is, in the second run, as the first left it.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    BackendError
        If the network raises an error in a step.
    """
    backend = registry.get(options.backend).name
    probes = probes_by_name(network)
    beside = _twin(network) if options.beside_float and backend != FLOAT else None
    with _opened(network, options, backend, progress) as sim:
        start = time.perf_counter()
        _advance(sim, options.steps, f"simulating on {backend}", progress)
        wall_s = time.perf_counter() - start
        values = {name: sim.data[probe] for name, probe in probes.items()}
        times = {name: sim.trange(probe.sample_every) for name, probe in probes.items()}
        activity, compilation = sim.activity, sim.compilation
        report_json = None if compilation is None else sim.report()
    exact: dict[str, np.ndarray] = {}
    if beside is not None:
        with _opened(beside, options, FLOAT, progress) as sim:
            _advance(sim, options.steps, "simulating in float Nengo", progress)
            exact = {name: sim.data[p] for name, p in probes_by_name(beside).items()}
    recorded = {
        name: Recorded(times[name], values[name], exact.get(name), records_spikes(probe))
        for name, probe in probes.items()
    }
    report = None if compilation is None else compilation.report
    return Ran(backend, recorded, activity, report, report_json, wall_s)


def _twin(network: nengo.Network) -> nengo.Network:
    """Return a copy of a network, or, where an object of a user's cannot be copied, itself."""
    # Building it a second time gives other weights wherever a user's random numbers have no seed.
    try:
        return network.copy(add_to_container=False)
    except Exception:  # whatever copying a user's object raises
        return network


def _opened(
    network: nengo.Network, options: RunOptions, backend: str, progress: Progress
) -> Simulator:
    """Return the network in a simulator; float Nengo runs it as it was written, without passes."""
    return Simulator(
        network,
        chip=options.chip,
        backend=backend,
        seed=options.seed,
        pipeline="" if backend == FLOAT else options.pipeline,
        progress=progress,
    )


def _advance(sim: Simulator, steps: int, what: str, progress: Progress) -> None:
    for i in range(steps):
        if i % PROGRESS_STEPS == 0:
            progress(what, i / steps)
        try:
            sim.step()
        except SpikeportError:
            raise
        except Exception as error:  # whatever the functions of the network's nodes raise
            reason = f"{type(error).__name__}: {error}"
            raise BackendError(f"{what}: step {i + 1}: the network raised {reason}") from error
