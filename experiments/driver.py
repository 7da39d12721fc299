"""The driver of all experiments: it prepares, performs, records and writes a trial."""

import contextlib
import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import nengo
import xarray as xr

from spikeport.compile.check.lost_values import cut_off_by_design
from spikeport.compile.report.report import in_result
from spikeport.constants import DT_S
from spikeport.errors import BoardLostError, DivergedError, RobotLostError
from spikeport.experiments import run_folder, watching
from spikeport.experiments.costs import Amounts, by_unit
from spikeport.experiments.digests import check_unchanged, digests_of_present
from spikeport.experiments.link_lines import link_line, robot_line
from spikeport.experiments.options import Options, Outcome, keeps_to_a_clock
from spikeport.experiments.pictures import (
    Scenes,
    check_video,
    draw_scenes,
    with_poses,
    write_video,
)
from spikeport.experiments.run_folder import Result
from spikeport.experiments.stepping import advance
from spikeport.experiments.trial import ClosedLoop, Rig, Trial
from spikeport.plots import plain, rendered
from spikeport.robot.plant import Plant
from spikeport.simulator import Simulator

K = TypeVar("K", bound=Rig)
R = TypeVar("R")
DAMPED_STEPS = 150
"""Steps of damping after the controller was lost; they and the steps just before are kept."""
PROGRESS_STEPS = 50
"""Steps from one report of progress to the next."""


class Ready(NamedTuple, Generic[K]):
    """A closed loop in a simulator, for all trials that need the same network."""

    closed: ClosedLoop[K]
    sim: Simulator

    def close(self) -> None:
        """Close simulator and plant, even if one of them raises an error."""
        with self.sim, contextlib.closing(self.closed.rig.plant):
            pass


@cut_off_by_design()
def run(trial: Trial[K, R], folder: Path) -> Outcome:
    """Run a trial and write its folder.

    Raises
    ------
    UsageError
        If the trial asks for something that cannot be done, or one of its files changes meanwhile.
    DoesNotFitError, CompileError, BackendError
        If its network cannot be compiled, or the chip cannot be opened.
    RenderError, MissingExtraError, OSError
        If it asks for a video that cannot be made on this machine.
    DivergedError
        If a number is not finite; the last states are in the folder.
    BoardLostError, RobotLostError
        If the board or the robot at the end of a link is gone; the last states are in the folder.
    """
    options = trial.options
    if options.video:
        # Checked before the run: a missing encoder found later would cost the whole run.
        with contextlib.closing(trial.plant()) as plant:
            check_video(plant)
    files = digests_of_present(trial.files)
    ready = prepare(trial)
    rig = ready.closed.rig
    with ready.sim as sim, contextlib.closing(rig.plant):
        # Later changes do not matter: the run has read all of its files.
        check_unchanged(files)
        done = _performed(trial, ready, folder)
    found = outcome(trial, ready, done, files)
    options.progress("writing", None)
    _write(trial, rig, done, found.result, sim, folder)
    return found


def _performed(trial: Trial[K, R], ready: Ready[K], folder: Path) -> R:
    """Perform a run; if it breaks off, leave the robot damped and write its last states."""
    plant = ready.closed.rig.plant
    try:
        return perform(trial, ready, folder)
    except DivergedError as error:
        # Close the plant first: this damps a robot, and writing the states takes long.
        plant.close()
        path = run_folder.write_last_states(folder, plant.history())
        raise DivergedError(f"{error}; the last states are in {path}") from error
    except BoardLostError as error:
        # The robot itself is still there: damp it before its states are written.
        damp(plant)
        path = run_folder.write_last_states(folder, plant.history())
        raise BoardLostError(
            f"{error}; the robot went into damping, its last states are in {path}"
        ) from None
    except RobotLostError as error:
        plant.close()
        if not len(plant.history()["time_s"]):  # no robot was ever there
            raise
        path = run_folder.write_last_states(folder, plant.history())
        raise RobotLostError(f"{error}; its last states are in {path}") from None


def damp(plant: Plant) -> None:
    """Damp a robot without a controller, so that it sinks instead of falling without torque."""
    plant.damp()
    # If no state came for long, for example while the run waited for the board, the controller of
    # a robot that is started by hand has damped it and raises this error.
    with contextlib.suppress(RobotLostError):
        for _ in range(DAMPED_STEPS):
            plant.step()


def prepare(trial: Trial[K, R]) -> Ready[K]:
    """Build a trial's network and compile it; an analytic controller runs in plain Nengo.

    Raises
    ------
    UsageError
        If the trial asks for something that cannot be done.
    DoesNotFitError, CompileError, BackendError
        If its network cannot be compiled, or the chip cannot be opened.
    """
    closed = trial.close_loop(trial.plant())
    return Ready(closed, simulator(closed.network, trial.options))


def simulator(network: nengo.Network, options: Options) -> Simulator:
    """Return a simulator of a controller's network, compiled as the options say."""
    return Simulator(
        network,
        chip=options.chip,
        backend=options.backend if options.has_neurons else "reference",
        dt=DT_S,
        seed=options.seed,
        # Without neurons on the chip there is nothing to rewrite.
        pipeline=options.pipeline if options.has_neurons else "",
        counts=options.counts,
        progress=options.progress,
        link=options.link,
        cache=options.cache,
    )


def perform(trial: Trial[K, R], ready: Ready[K], folder: Path | None = None) -> R:
    """Run a trial in the loop prepared for it, or for a trial with the same network.

    Viewers of ``folder`` get answers while the trial runs, unless it keeps to a clock.

    Raises
    ------
    DivergedError
        If a number is not finite.
    """
    options, (closed, sim) = trial.options, ready
    # The simulator has run another trial: its network is the same, but its state is not.
    if sim.n_steps:
        sim.reset(options.seed)
    trial.begin(closed.rig)
    watched = None if keeps_to_a_clock(options.link, options.robot) else folder
    wall_s = _simulate(trial, ready, watched)
    # Damps a robot: recording a long run takes longer than it may be without commands.
    closed.rig.plant.close()
    return trial.record(closed, sim, wall_s)


def _simulate(trial: Trial[K, R], ready: Ready[K], watched: Path | None) -> float:
    """Run all steps, or until the run is over, and return their wall-clock time in seconds."""
    rig, sim, options = ready.closed.rig, ready.sim, trial.options
    steps = round(options.seconds / DT_S)
    start = time.perf_counter()

    def so_far() -> xr.Dataset:
        return series(trial, rig, trial.record(ready.closed, sim, time.perf_counter() - start))

    for i in range(steps):
        if rig.loop.over:
            break
        advance(sim)
        if i % PROGRESS_STEPS == 0:
            options.progress("simulating", i / steps)
            # A recording has rows from the robot's first step on.
            if watched is not None and rig.film.poses:
                watching.answer(watched, so_far)
    # Only a fall ends a run early; without any pose there is nothing to measure or draw.
    if rig.loop.over and not rig.film.poses:
        raise RobotLostError(
            "the robot lies on the floor as the run begins; cure: stand it up, or restart the "
            "simulated robot"
        )
    return time.perf_counter() - start


def series(trial: Trial[K, R], rig: Rig, done: R) -> xr.Dataset:
    """Return the time series of a run that are kept, with the robot's poses."""
    return with_poses(trial.probes(done), rig.film)


def outcome(trial: Trial[K, R], ready: Ready[K], done: R, files: Mapping[str, str]) -> Outcome:
    """Return the result, report and counts of a trial that has run.

    ``files`` are the digests of its files, as they were when its network was made.
    """
    settings, options, sim = dataclasses.asdict(trial.settings), trial.options, ready.sim
    robot: Mapping[str, Any] | None = ready.closed.rig.plant.link
    if robot is not None and "estimator" in settings:
        # The estimator of the robot's link, which the settings do not choose.
        settings["estimator"] = robot["estimator"]["name"]
    result = {
        "command": list(options.command),
        "experiment": trial.name,
        "backend": options.backend,
        "seconds": options.seconds,
        "seeds": {"run": options.seed, "network": settings["network_seed"]},
        "settings": settings,
        "files": dict(files),
        "metrics": trial.metrics(done),
        "activity": sim.activity.totals(),
        "link": sim.link,
        "robot": robot,
        **on_chip(sim),
        "energy_by_unit": _by_unit(sim, {"second": sim.time, **trial.amounts(done)}),
    }
    report = None if sim.compilation is None else sim.compilation.report
    return Outcome(result, report, sim.activity)


def _by_unit(sim: Simulator, amounts: Amounts) -> dict[str, Any] | None:
    """Return the energy per unit of the robot's work; None without a chip."""
    if sim.compilation is None:
        return None
    return by_unit(sim.activity, sim.compilation.report.chip, amounts, sim.n_steps)


def on_chip(sim: Simulator) -> dict[str, Any]:
    """Return digest, resources, energy, timing and host I/O; None for each without a chip."""
    return in_result(None if sim.compilation is None else sim.report())


def _write(
    trial: Trial[K, R], rig: Rig, done: R, result: Result, sim: Simulator, folder: Path
) -> None:
    """Write a run's folder, whole, in place of an earlier run."""
    scenes: Scenes = trial.scenes(done)
    pictures = draw_scenes(rig.film, scenes)
    with run_folder.renewed(folder) as new:
        run_folder.write_probes(new, series(trial, rig, done))
        figure = trial.figure(done, pictures, result)
        if result["link"] is not None:
            line = plain(link_line(result["link"]))
            figure.text(0.995, 0.003, line, ha="right", va="bottom", size=6)
        if result["robot"] is not None:
            figure.text(0.005, 0.003, robot_line(result["robot"]), va="bottom", size=6)
        run_folder.write_figure(new, rendered(figure))
        if sim.compilation is not None:
            run_folder.write_report(new, sim.report(), trial.name)
        if rig.loop.over:
            run_folder.add_last_states(new, rig.plant.history())
        if trial.options.video:
            write_video(new, rig.film, scenes)
        run_folder.add_counts(new, trial.options.counts)
        run_folder.write_result(new, result)
