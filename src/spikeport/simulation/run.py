"""A network on a backend, and beside it in float Nengo."""

import functools
import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import nengo
import numpy as np

from spikeport.backends import registry
from spikeport.backends.attempt import attempt
from spikeport.backends.board.link import OWN_STUB, LinkOptions
from spikeport.compile.ground.names import Names
from spikeport.compile.ground.refusal import RefusedError
from spikeport.compile.ground.scope import Scope
from spikeport.compile.passes.pipeline import Pipeline
from spikeport.compile.report.report import Report
from spikeport.fresh_copy import fresh_copy
from spikeport.hardware_models.activity import Activity
from spikeport.progress import Progress, silent
from spikeport.simulation.probes import probes_by_name, records_spikes
from spikeport.simulation.recorded import Recorded
from spikeport.simulator import Simulator

FLOAT = "reference"
PROGRESS_STEPS = 50
"""Steps from one report of progress to the next."""


@dataclass(frozen=True, kw_only=True)
class SimulationOptions:
    """The options of a simulation.

    Attributes
    ----------
    steps : int
        Number of steps.
    backend, chip, pipeline : str
        The backend and chip it runs on, and the passes of its compile; by default the chip's.
    offload : bool
        Move ensembles that break a rule of the chip to the host.
    seed : int
        Seed of noise and processes.
    beside_float : bool
        Run it in float Nengo, too, after the run on the backend.
    link : LinkOptions
        The link to a board, for backends that have one.
    counts : Path or None
        A folder for the counts of every step and core.
    """

    steps: int
    backend: str = "native"
    chip: str | Path = "loihi"
    pipeline: Pipeline | str | None = None
    offload: bool = False
    seed: int = 0
    beside_float: bool = True
    link: LinkOptions = OWN_STUB
    counts: Path | None = None


class Ran(NamedTuple):
    """The outcome of a run: recordings by probe, and the report on the chip, if there was one.

    ``report`` and ``report_json`` are None if nothing was compiled; ``wall_s`` is the wall-clock
    time that the run on the backend took; ``link`` has the figures of the link to a board.
    """

    backend: str
    recorded: dict[str, Recorded]
    activity: Activity
    report: Report | None
    report_json: dict[str, Any] | None
    wall_s: float
    link: dict[str, object] | None


Watch = Callable[[Callable[[], dict[str, Recorded]]], None]
"""A function that is called now and then, with a function that returns the recordings so far."""


def unwatched(_recorded: Callable[[], dict[str, Recorded]]) -> None:
    """Ignore the recordings."""


def run(
    network: nengo.Network,
    options: SimulationOptions,
    progress: Progress = silent,
    watch: Watch = unwatched,
) -> Ran:
    """Run a network on a backend and, with ``beside_float``, in float Nengo afterwards.

    Float Nengo runs a copy, so that the objects and functions that nodes call (an environment) do
    not go on where the first run left them, see `spikeport.fresh_copy`.

    Raises
    ------
    DoesNotFitError, CompileError
        If the network cannot be put on the chip.
    BackendError
        If the network raises an error in a step, or before the first.
    """
    backend = registry.get(options.backend).name
    probes = probes_by_name(network)
    beside = fresh_copy(network) if options.beside_float and backend != FLOAT else None
    with _opened(network, options, backend, progress) as sim:
        if sim.compilation is None:  # nothing is on the chip: float Nengo would run twice
            backend, beside = FLOAT, None

        def advanced(what: str, share: float | None) -> None:
            progress(what, share)
            if sim.n_steps:
                watch(lambda: _recorded(sim, probes))

        start = time.perf_counter()
        _advance(sim, options.steps, f"simulating on {backend}", advanced)
        wall_s = time.perf_counter() - start
        recorded = _recorded(sim, probes)
        activity, compilation, link = sim.activity, sim.compilation, sim.link
        report_json = None if compilation is None else sim.report()
    if beside is not None:
        for name, values in _beside(beside, options, progress).items():
            recorded[name] = replace(recorded[name], values_float=values)
    report = None if compilation is None else compilation.report
    return Ran(backend, recorded, activity, report, report_json, wall_s, link)


def _beside(
    network: nengo.Network, options: SimulationOptions, progress: Progress
) -> dict[str, np.ndarray]:
    """Return the data of a network in float Nengo, none if Nengo refuses it.

    A pass may let the chip run a network that Nengo refuses; the finished run is not lost then.
    """
    try:
        return _in_float(network, options, progress)
    except RefusedError as refusal:
        warnings.warn(f"not compared with float Nengo: {refusal}", stacklevel=3)
        return {}


def _in_float(
    network: nengo.Network, options: SimulationOptions, progress: Progress
) -> dict[str, np.ndarray]:
    """Run a network in float Nengo; return the data of the probes that are not in chip units."""
    with _opened(network, options, FLOAT, progress) as sim:
        _advance(sim, options.steps, "simulating in float Nengo", progress)
        scope = Scope(network, Names(network))
        return {
            name: _values(sim, probe)
            for name, probe in probes_by_name(network).items()
            if not scope.in_chip_units(probe)
        }


def _recorded(sim: Simulator, probes: Mapping[str, nengo.Probe]) -> dict[str, Recorded]:
    """Return the recordings of a run so far."""
    return {
        name: Recorded(
            sim.trange(probe.sample_every), _values(sim, probe), None, records_spikes(probe)
        )
        for name, probe in probes.items()
    }


def _values(sim: Simulator, probe: nengo.Probe) -> np.ndarray:
    """Return the data of a probe, (n, size); weights row by row."""
    found: np.ndarray = sim.data[probe]
    return found.reshape(len(found), math.prod(found.shape[1:]))


def _opened(
    network: nengo.Network, options: SimulationOptions, backend: str, progress: Progress
) -> Simulator:
    """Return the network in a simulator; float Nengo runs it as it was written, without passes."""
    make = functools.partial(
        Simulator,
        network,
        chip=options.chip,
        backend=backend,
        seed=options.seed,
        pipeline="" if backend == FLOAT else options.pipeline,
        offload=options.offload and backend != FLOAT,
        progress=progress,
        counts=None if backend == FLOAT else options.counts,
        link=OWN_STUB if backend == FLOAT else options.link,
    )
    return attempt(f"before step 1 on {backend}", make)


def _advance(sim: Simulator, steps: int, what: str, progress: Progress) -> None:
    for i in range(steps):
        if i % PROGRESS_STEPS == 0:
            progress(what, i / steps)
        attempt(f"{what}: step {i + 1}", sim.step)
