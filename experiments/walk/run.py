"""One run of the walking robot in closed loop, from its settings to a written folder."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import nengo
import numpy as np

from spikeport.experiments import closed_loop, run_folder
from spikeport.experiments.closed_loop import DT_S, open_simulator, simulate
from spikeport.experiments.options import Outcome
from spikeport.experiments.pictures import check_video, picture, write_video
from spikeport.experiments.policy.readout import check_calibrated
from spikeport.experiments.walk.controller import walk_controller
from spikeport.experiments.walk.figure import walk_figure
from spikeport.experiments.walk.gait import encoding, record_gait
from spikeport.experiments.walk.loop import OBSERVATION_DT_S, WalkLoop, close_loop
from spikeport.experiments.walk.metrics import metrics
from spikeport.experiments.walk.picture import CAMERA, walk_marks
from spikeport.experiments.walk.probes import write_probes
from spikeport.experiments.walk.silence_figure import silence_figure
from spikeport.experiments.walk.trial import WalkRun, WalkTrial
from spikeport.robot.walk_interface import CONTROL_DT_S
from spikeport.simulator import Simulator


class Closed(NamedTuple):
    """Plant and controller in one network, and probes of some of its neurons."""

    loop: WalkLoop
    network: nengo.Network
    spikes: Sequence[nengo.Probe]


class Rig(NamedTuple):
    """What was closed, in a simulator, ready for all runs that need the same network."""

    closed: Closed
    sim: Simulator


def run(trial: WalkTrial) -> Outcome:
    """Run the experiment and write its folder."""
    options = trial.options
    rig = prepare(trial)
    with rig.sim as sim:
        done = perform(trial, rig)
    outcome = closed_loop.outcome(trial, sim, metrics(done))
    options.progress("writing", None)
    loop, marks = rig.closed.loop, walk_marks(done)
    _write(trial, loop, done._replace(picture=picture(loop, marks, CAMERA)), outcome.result)
    return outcome


def prepare(trial: WalkTrial) -> Rig:
    """Check what a trial asks for, build its network and compile it; raises as `closed`."""
    ready = closed(trial)
    return Rig(ready, open_simulator(ready.network, trial.options))


def closed(trial: WalkTrial) -> Closed:
    """Check what a trial asks for, and build its network, robot and all.

    Raises
    ------
    UsageError
        If its path cannot be followed, its policy is not for this robot, or its calibration was
        made for another.
    RenderError, MissingExtraError
        If it asks for a video that cannot be made here.
    """
    settings, options = trial.settings, trial.options
    trial.path()
    weights = settings.walking_policy()
    if not trial.exact_policy:
        check_calibrated(trial, weights)
    options.progress("recording the gait of the exact policy", None)
    gait = record_gait(weights)
    box = None if trial.exact_policy else encoding(gait)
    every_s = CONTROL_DT_S if trial.exact_policy else OBSERVATION_DT_S
    loop = WalkLoop(box, every_s, DT_S, settings.appearance)
    if options.video:
        check_video(options.folder, loop)
    options.progress("building the controller", None)
    controller = walk_controller(trial, weights, gait)
    with nengo.Network(label=trial.name, seed=settings.network_seed) as network:
        network.add(controller)
        close_loop(controller, loop)
    return Closed(loop, network, controller.spikes)


def perform(trial: WalkTrial, rig: Rig) -> WalkRun:
    """Run a trial on a rig that was prepared for it, or for one with the same network.

    Raises
    ------
    DivergedError
        If an action is not finite; the last states are in the folder.
    """
    (loop, _, probes), sim = rig
    if sim.n_steps:
        sim.reset(trial.options.seed)
    path = trial.path()
    loop.begin(trial.options.seed, path)
    wall_s = simulate(sim, loop.plant, trial.options, lambda: loop.over)
    spikes = np.hstack([sim.data[probe] != 0 for probe in probes]) if probes else None
    return WalkRun(
        path=path,
        seconds=trial.options.seconds,
        recording=loop.recording(),
        fallen_at_s=loop.fallen_at_s,
        encoding=loop.encoding,
        sim=sim,
        wall_s=wall_s,
        spikes=spikes,
    )


def _write(trial: WalkTrial, loop: WalkLoop, done: WalkRun, result: dict[str, Any]) -> None:
    folder = trial.options.folder
    run_folder.clear(folder)
    write_probes(folder, done.recording, done.spikes)
    draw = walk_figure if done.spikes is None else silence_figure
    run_folder.write_figure(folder, draw(done, result))
    if done.fallen_at_s is not None:
        run_folder.add_last_states(folder, loop.plant.history())
    if trial.options.video:
        write_video(folder, loop, walk_marks(done), CAMERA)
    run_folder.write_result(folder, result)
