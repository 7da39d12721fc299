"""What all runs in closed loop share: the simulator, its steps, and what is left."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any, Protocol

import nengo
from nengo.exceptions import SimulationError

from spikeport.errors import DivergedError
from spikeport.experiments import run_folder
from spikeport.experiments.on_chip import on_chip
from spikeport.experiments.options import Options, Outcome
from spikeport.robot.plant import Plant
from spikeport.simulator import Simulator

BACKENDS = ("analytic", "reference", "native", "nengo-loihi")
DT_S = 0.001
"""Time step of all controllers."""


def open_simulator(network: nengo.Network, options: Options) -> Simulator:
    """Compile a network for a run; what is analytic runs in plain Nengo."""
    options.progress("compiling", None)
    analytic = options.backend == "analytic"
    return Simulator(
        network,
        chip=options.chip,
        backend="reference" if analytic else options.backend,
        dt=DT_S,
        seed=options.seed,
        pipeline="" if analytic else options.pipeline,
    )


def simulate(
    sim: Simulator, plant: Plant, options: Options, over: Callable[[], bool] = lambda: False
) -> float:
    """Run all steps, or until it is over; returns the wall-clock time they took, in seconds.

    Raises
    ------
    DivergedError
        If a number is not finite; the last states are in the folder.
    """
    steps = round(options.seconds / DT_S)
    start = time.perf_counter()
    try:
        for i in range(steps):
            if over():
                break
            sim.step()
            if i % 50 == 0:
                options.progress("simulating", i / steps)
    except (DivergedError, SimulationError) as error:  # Nengo's: a node gave NaN or infinity
        path = run_folder.write_last_states(options.folder, plant.history())
        raise DivergedError(f"{error}; the last states are in {path}") from error
    return time.perf_counter() - start


class Trial(Protocol):
    """An experiment's settings, and the options of a run."""

    name: str

    @property
    def settings(self) -> Any:
        """A dataclass with a ``network_seed``."""

    @property
    def options(self) -> Options:
        """Those of the run."""


def outcome(trial: Trial, sim: Simulator, metrics: dict[str, Any]) -> Outcome:
    """What a run leaves, to be written."""
    settings, options = trial.settings, trial.options
    result = {
        "command": list(options.command),
        "experiment": trial.name,
        "backend": options.backend,
        "seconds": options.seconds,
        "seeds": {"run": options.seed, "network": settings.network_seed},
        "settings": dataclasses.asdict(settings),
        "metrics": metrics,
        "activity": sim.activity.totals(),
        **on_chip(sim),
    }
    report = None if sim.compilation is None else sim.compilation.report
    return Outcome(result, report, sim.activity)
